#pragma once

// What design minimises, and how a vector of numbers is a mechanism.

#include <lumihull/capture/design.h>

#include <Eigen/Core>

namespace lumihull::capture::design {

/// Number of unknowns: two a departure point, an angle an attachment point, the circle's radius.
int unknowns(const Mechanism& base, const DesignOptions& options);

/// Any real numbers are a mechanism: what is bounded is reflected at 0 and 1, what is periodic has the period 1.
Mechanism decoded(const Mechanism& base, const DesignOptions& options, const Eigen::VectorXd& x);

/// MechanismDesign::objective.
double objective(const Mechanism& mechanism, const DesignOptions& options);

}  // namespace lumihull::capture::design
