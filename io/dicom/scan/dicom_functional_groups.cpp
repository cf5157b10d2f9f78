// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_functional_groups.h"

#include <dcmtk/dcmdata/dcdeftag.h>

namespace tetwarp {

const std::vector<FunctionalGroup>& functional_groups() {
  static const std::vector<FunctionalGroup> groups = {
      {DCM_PixelMeasuresSequence, {DCM_PixelSpacing, DCM_SliceThickness, DCM_SpacingBetweenSlices}},
      {DCM_PlanePositionSequence, {DCM_ImagePositionPatient}},
      {DCM_PlaneOrientationSequence, {DCM_ImageOrientationPatient}},
      {DCM_PixelValueTransformationSequence, {DCM_RescaleIntercept, DCM_RescaleSlope, DCM_RescaleType}},
      {DCM_FrameVOILUTSequence,
       {DCM_WindowCenter, DCM_WindowWidth, DCM_WindowCenterWidthExplanation, DCM_VOILUTFunction}},
      {DCM_FrameContentSequence,
       {DCM_StackID, DCM_TemporalPositionIndex, DCM_DimensionIndexValues},
       {{DCM_FrameAcquisitionNumber, DCM_AcquisitionNumber},
        {DCM_FrameAcquisitionDateTime, DCM_AcquisitionDateTime},
        {DCM_FrameComments, DCM_ImageComments}}},
      {DCM_CardiacSynchronizationSequence, {DCM_NominalPercentageOfCardiacPhase, DCM_NominalCardiacTriggerDelayTime}},
      {DCM_RespiratorySynchronizationSequence, {DCM_NominalPercentageOfRespiratoryPhase}},
      {DCM_FrameAnatomySequence, {DCM_AnatomicRegionSequence}, {{DCM_FrameLaterality, DCM_ImageLaterality}}},
      {DCM_IrradiationEventIdentificationSequence, {DCM_IrradiationEventUID}},
      {DCM_CTImageFrameTypeSequence, {}, {{DCM_FrameType, DCM_ImageType}}},
      {DCM_CTAcquisitionDetailsSequence,
       {DCM_RotationDirection, DCM_RevolutionTime, DCM_SingleCollimationWidth, DCM_TotalCollimationWidth,
        DCM_TableHeight, DCM_GantryDetectorTilt, DCM_DataCollectionDiameter}},
      {DCM_CTTableDynamicsSequence, {DCM_TableSpeed, DCM_TableFeedPerRotation, DCM_SpiralPitchFactor}},
      {DCM_CTPositionSequence, {DCM_ReconstructionTargetCenterPatient, DCM_DataCollectionCenterPatient}},
      {DCM_CTGeometrySequence, {DCM_DistanceSourceToDetector}},
      {DCM_CTReconstructionSequence, {DCM_ConvolutionKernel, DCM_ReconstructionDiameter}},
      {DCM_CTExposureSequence,
       {DCM_ExposureModulationType, DCM_CTDIvol, DCM_CTDIPhantomTypeCodeSequence},
       {{DCM_ExposureTimeInms, DCM_ExposureTime},
        {DCM_XRayTubeCurrentInmA, DCM_XRayTubeCurrent},
        {DCM_ExposureInmAs, DCM_Exposure}}},
      {DCM_CTXRayDetailsSequence,
       {DCM_KVP, DCM_FocalSpots, DCM_FilterType, DCM_CalciumScoringMassFactorPatient,
        DCM_CalciumScoringMassFactorDevice, DCM_EnergyWeightingFactor}},
  };
  return groups;
}

}  // namespace tetwarp
