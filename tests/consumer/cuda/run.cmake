execute_process(COMMAND "${work}/cuda/device" COMMAND_ERROR_IS_FATAL ANY)
