// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Debian's ITK knows the one compiler that it was built with, and refuses clang. It recognises g++ by these macros, and
// what it assumes of g++ 12 is true of clang 14 and 19, too. The preset fuzz and cmake/platforms/rows.sh include this
// header before everything else. A precompiled header that has it must be made with ITK's folder among those of
// headers: clang does not read it again then.
#if __has_include(<itk_compiler_detection.h>)
#pragma push_macro("__clang__")
#pragma push_macro("__GNUC__")
#undef __clang__
#undef __GNUC__
#define __GNUC__ 12
#include <itk_compiler_detection.h>
#pragma pop_macro("__GNUC__")
#pragma pop_macro("__clang__")
#endif
