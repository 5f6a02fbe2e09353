// The values behind the @names@ of the .g files: read from the code, so that a proof is about the
// constants that the tracers are compiled with.
#ifndef PROOFS_CONSTANTS_H
#define PROOFS_CONSTANTS_H

#include <array>
#include <string_view>

#include "common/interop/constants.h"
#include "common/interop/hit_rule.h"
#include "common/interop/packet_bounds.h"
#include "common/interop/winding_rule.h"
#include "cpu/simd/rounding_bounds.h"
#include "lab/proofs/bounds.h"

namespace mray::proofs {

struct Constant {
    std::string_view name;
    double value;
};

// NOLINTNEXTLINE(cppcoreguidelines-macro-usage)
#define PROOFS_CONSTANT(name) \
    Constant { #name, name }

/// Returns the part of the depth margin that surely_inside spends.
inline float depth_slack_of_margin() {
    const vec3 org(0, 0, 0);
    return shear_ray(org, vec3(0, 0, 1)).depth_slack / depth_margin(org);
}

inline const std::array kConstants = {
    PROOFS_CONSTANT(kSceneExtent),
    PROOFS_CONSTANT(kOriginExtent),
    PROOFS_CONSTANT(kProjectedOnGrid),
    PROOFS_CONSTANT(kProjectedSnap),
    PROOFS_CONSTANT(kFastProjectionError),
    PROOFS_CONSTANT(kFastProjectionFloor),
    PROOFS_CONSTANT(kCoordinateError),
    PROOFS_CONSTANT(kWindingEdgeError),
    PROOFS_CONSTANT(kWindingHeightError),
    Constant{"kSideError", cpu::kSideError},
    Constant{"kLeastSideError", cpu::kLeastSideError},
    Constant{"kSideRounding", cpu::kSideRounding},
    Constant{"kSideSlant", cpu::kSideSlant},
    Constant{"kLongestDirection2", cpu::kLongestDirection2},
    Constant{"kNearestVertexRounding", cpu::kNearestVertexRounding},
    Constant{"kNearestVertexErrorSquare", cpu::kNearestVertexErrorSquare},
    Constant{"kLeastNearestVertexErrorSquare", cpu::kLeastNearestVertexErrorSquare},
    PROOFS_CONSTANT(kWeightRounding),
    PROOFS_CONSTANT(kMeanRounding),
    PROOFS_CONSTANT(kHugeReciprocal),
    PROOFS_CONSTANT(kPadOfExtent),
    PROOFS_CONSTANT(kPadOfPlane),
    PROOFS_CONSTANT(kDilationOfOrigin),
    PROOFS_CONSTANT(kDilationOfExtent),
    PROOFS_CONSTANT(kSlabRounding),
    PROOFS_CONSTANT(kDepthRounding),
    PROOFS_CONSTANT(kSlabReciprocal),
    Constant{"kUnfusedDilation", cpu::kUnfusedDilation},
    Constant{"kFusedSlabRounding", cpu::kFusedSlabRounding},
    PROOFS_CONSTANT(kDepthMargin),
    PROOFS_CONSTANT(kSurfaceOffset),
    Constant{"kDepthSlackOfMargin", depth_slack_of_margin()},
    PROOFS_CONSTANT(kRounding),
    PROOFS_CONSTANT(kDifferenceOfProducts),
    PROOFS_CONSTANT(kProjection),
    PROOFS_CONSTANT(kProjectionOfRange),
    PROOFS_CONSTANT(kProjectionSnap),
    PROOFS_CONSTANT(kRcpUlp),
    PROOFS_CONSTANT(kRsqrtUlp),
    PROOFS_CONSTANT(kRangeOfDepths),
    PROOFS_CONSTANT(kSizeOfDepths),
    PROOFS_CONSTANT(kTravel),
    PROOFS_CONSTANT(kSpareOfBound),
    PROOFS_CONSTANT(kExtentError),
    PROOFS_CONSTANT(kDistanceError),
    PROOFS_CONSTANT(kGridError),
    PROOFS_CONSTANT(kPlaneFloor),
    PROOFS_CONSTANT(kLateralError),
    PROOFS_CONSTANT(kShearError),
    PROOFS_CONSTANT(kDepthError),
    PROOFS_CONSTANT(kRectangleError),
    PROOFS_CONSTANT(kQuotientError),
    PROOFS_CONSTANT(kRectangleRounding),
    PROOFS_CONSTANT(kEdgeRounding),
    PROOFS_CONSTANT(kShearRounding),
    PROOFS_CONSTANT(kVolumeError),
    PROOFS_CONSTANT(kLeastVolume),
    PROOFS_CONSTANT(kLeastSlantVolume),
    PROOFS_CONSTANT(kMostVolume),
    PROOFS_CONSTANT(kRayError),
    PROOFS_CONSTANT(kVolumeRounding),
    PROOFS_CONSTANT(kVolumeExtentError),
    PROOFS_CONSTANT(kEitherSign),
    PROOFS_CONSTANT(kPlaneError),
    PROOFS_CONSTANT(kSteepError),
    PROOFS_CONSTANT(kGradientRounding),
    PROOFS_CONSTANT(kReciprocalRounding),
    PROOFS_CONSTANT(kRuleDepthError),
    PROOFS_CONSTANT(kVertexOfPlace),
    PROOFS_CONSTANT(kVertexOfEdges),
    PROOFS_CONSTANT(kVertexOfExtent),
    PROOFS_CONSTANT(kVertexOfRange),
    PROOFS_CONSTANT(kFarDepth),
    PROOFS_CONSTANT(kLeavingError),
    PROOFS_CONSTANT(kBehindError),
    PROOFS_CONSTANT(kDepthlessBound),
    PROOFS_CONSTANT(kCertainBound),
    PROOFS_CONSTANT(kCertainDepth),
    PROOFS_CONSTANT(kBeyondBound),
    PROOFS_CONSTANT(kBeyondDepth),
    PROOFS_CONSTANT(kMissBound),
    PROOFS_CONSTANT(kBlockBound),
    PROOFS_CONSTANT(kMissGradient),
    PROOFS_CONSTANT(kBlockGradient),
    PROOFS_CONSTANT(kDirectionRounding),
    PROOFS_CONSTANT(kEndError),
    PROOFS_CONSTANT(kStoredPlaceRounding),
    PROOFS_CONSTANT(kHitDepthRounding),
    PROOFS_CONSTANT(kHitDotRounding),
    PROOFS_CONSTANT(kBoxError),
    PROOFS_CONSTANT(kWedgeMargin),
    PROOFS_CONSTANT(kLeastWedgeSpan),
    PROOFS_CONSTANT(kMostWedgeDepths),
    PROOFS_CONSTANT(kVertexError),
    PROOFS_CONSTANT(kSlantExtent),
    PROOFS_CONSTANT(kSlantDistance),
    PROOFS_CONSTANT(kFastDepthOfMargin),
    PROOFS_CONSTANT(kRayDepthError),
    PROOFS_CONSTANT(kUnfusedDepth),
    PROOFS_CONSTANT(kMostSlope),
    PROOFS_CONSTANT(kNearestByDepth),
    PROOFS_CONSTANT(kEdgeLateral),
    PROOFS_CONSTANT(kEdgeMiddle),
    PROOFS_CONSTANT(kEdgeConstant),
    PROOFS_CONSTANT(kRuleDepthFactor),
};

#undef PROOFS_CONSTANT

}  // namespace mray::proofs

#endif  // PROOFS_CONSTANTS_H
