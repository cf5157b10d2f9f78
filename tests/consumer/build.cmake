# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Configures, builds and runs the project PROJECT of this folder against the moved installation.
include("${SETTINGS}")
execute_process(COMMAND "${CMAKE_COMMAND}" --fresh -S "${source}/tests/consumer/${PROJECT}" -B "${work}/${PROJECT}"
                        ${same_compiler} "-DCMAKE_PREFIX_PATH=${installation}"
                OUTPUT_VARIABLE output ERROR_VARIABLE output COMMAND_ECHO STDOUT RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${output}")
endif()
execute_process(COMMAND "${CMAKE_COMMAND}" --build "${work}/${PROJECT}" --parallel 2 COMMAND_ERROR_IS_FATAL ANY)
include("${source}/tests/consumer/${PROJECT}/run.cmake" OPTIONAL)
