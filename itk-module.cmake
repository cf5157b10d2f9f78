# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# What ITK reads to know this repository as its module Tetwarp (docs/guide/itk.md): placed under Modules/Remote of ITK's
# sources, or built beside a build of ITK.
include("${CMAKE_CURRENT_LIST_DIR}/itkbridge/itk_modules.cmake")
itk_module(Tetwarp
  DEPENDS ${tetwarp_itk_modules}
  EXCLUDE_FROM_DEFAULT
  DESCRIPTION "Exact deformation of volumes by fields of moved vertices: no holes, no double writes, the same bits on CPU and GPU."
)
