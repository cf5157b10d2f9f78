execute_process(COMMAND "${work}/deform/twist" COMMAND_ERROR_IS_FATAL ANY)
