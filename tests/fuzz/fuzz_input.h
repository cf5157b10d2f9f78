// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// What tells one target from the others of its reader: tests/fuzz/CMakeLists.txt makes it of fuzz_input.cpp.in.

/// Suffix of the file that the bytes are written to.
extern const char* const kFuzzSuffix;
/// What is said behind the name of the file, one reading per text; null is the end.
extern const char* const kFuzzOptions[];
