# The modules of ITK that tetwarp::itkbridge is built on. One list for itkbridge/CMakeLists.txt and for the package.
set(tetwarp_itk_modules ITKCommon ITKIOImageBase ITKIOMeta ITKIONIFTI ITKIONRRD ITKMesh ITKTransform)
