execute_process(COMMAND "${work}/io/files" "${work}/io" COMMAND_ERROR_IS_FATAL ANY)
