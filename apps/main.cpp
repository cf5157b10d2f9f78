// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/program.h"

int main(int argc, char** argv) { return tetwarp::apps::run_program(argc, argv); }
