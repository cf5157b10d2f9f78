# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

set(hdf5 "${source}/tests/fuzz/corpus/transform-h5/both.h5")
execute_process(COMMAND "${work}/io/files" "${work}/io" "${hdf5}" COMMAND_ERROR_IS_FATAL ANY)
if(EXISTS "${installation}/bin/tetwarp")
  execute_process(COMMAND "${installation}/bin/tetwarp" info "${hdf5}" COMMAND_ERROR_IS_FATAL ANY)
endif()
