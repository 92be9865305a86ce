#pragma once

#include <lumihull/slf/light_field.h>

#include <vector>

#include "atlas/atlas.h"
#include "joint_fit.h"
#include "ring_fit.h"

namespace lumihull::slf {

/// Factors as bytes: surface maps as pictures, laid out by the atlas; view maps node by node. rms: what the factors
/// leave of the samples; the joint ones' view maps are rounded to a share of that.
std::vector<LightFieldTerm> terms_of(const JointFactors& factors, const Atlas& atlas, std::size_t vertices,
                                     std::size_t nodes, std::size_t terms, double rms);
std::vector<LightFieldTerm> terms_of(const RingFactors& factors, const Atlas& atlas, const Rings& rings,
                                     std::size_t nodes, const RingFitOptions& options);

}  // namespace lumihull::slf
