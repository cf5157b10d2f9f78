# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

set(tetwarp "${installation}/bin/tetwarp")
foreach(arguments
    "phantom -o ct.nii.gz --size 64,64,40 --spacing 5,5,8"
    "field wave:amplitude=12,wavelength=96 --like ct.nii.gz -o field.mha --cell-size 4"
    "deform ct.nii.gz -f field.mha -o expected.nii.gz")
  separate_arguments(arguments)
  execute_process(COMMAND "${tetwarp}" ${arguments} --overwrite WORKING_DIRECTORY "${work}/itkbridge"
                  OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
endforeach()
execute_process(COMMAND ./warp ct.nii.gz field.mha warped.nii.gz expected.nii.gz WORKING_DIRECTORY "${work}/itkbridge"
                COMMAND_ERROR_IS_FATAL ANY)
