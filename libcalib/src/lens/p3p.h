#pragma once

#include <Eigen/Core>
#include <array>

namespace lumihull::calib {

/// Poses (camera from world) from three points: rays (any length, z forward) and world points. Returns how many, 0 … 4;
/// all depths along the rays are positive.
///
/// The distances between the points give three quadrics ΛᵀM Λ = a² in the depths Λ; two combinations of them are cones,
/// and in their pencil there is a pair of planes, each of which meets a cone in two lines: Persson & Nordberg, Lambda
/// Twist (ECCV 2018), eq. 4 to 14. Here the planes are parametrised without division, so that no depth is special.
int p3p(const std::array<Eigen::Vector3d, 3>& rays, const std::array<Eigen::Vector3d, 3>& world,
        std::array<Eigen::Matrix3d, 4>& rotations, std::array<Eigen::Vector3d, 4>& translations);

}  // namespace lumihull::calib
