# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# The modules of ITK that tetwarp::itkbridge is built on. One list for itkbridge/CMakeLists.txt, for the package, and for
# itk-module.cmake.
set(tetwarp_itk_modules ITKCommon ITKMesh ITKTransform)
