# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

execute_process(COMMAND "${work}/backend/device" COMMAND_ERROR_IS_FATAL ANY)
