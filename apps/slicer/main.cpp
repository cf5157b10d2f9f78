// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/slicer/slicer_module.h"

int main(int argc, char** argv) { return tetwarp::apps::run_slicer_module(TETWARP_SLICER_COMMAND, argc, argv); }
