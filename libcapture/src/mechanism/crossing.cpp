// Cables that pass through each other between two poses.
#include <lumihull/capture/clearance.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry.h"
#include "segments.h"

namespace lumihull::capture {
namespace {

using Eigen::Vector3d;

/// Below this the chord is the arc.
constexpr double kChord_m = 1e-10;

/// The way of the platform between two poses, and of what is fixed to it.
struct Way {
  Pose from;
  Vector3d travel, axis;
  double angle = 0;

  Way(const Pose& start, const Pose& end) : from(start), travel(end.translation - start.translation) {
    Eigen::Quaterniond turn = end.rotation * start.rotation.conjugate();
    if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
    const double sine = turn.vec().norm();
    angle = 2 * std::atan2(sine, turn.w());
    axis = sine > 0 ? Vector3d(turn.vec() / sine) : Vector3d::UnitZ();
    if (angle < 1e-12) angle = 0;
  }

  Vector3d at(const Vector3d& arm, double time) const {
    if (angle == 0) return from.translation + arm + time * travel;
    const double c = std::cos(angle * time), s = std::sin(angle * time);
    return from.translation + time * travel + c * arm + s * axis.cross(arm) + (1 - c) * axis.dot(arm) * axis;
  }
};

/// A cable's outer end on its way, from its departure point.
struct Arm {
  Vector3d arm;          // from the platform's origin to the attachment, at the start, in the world
  Vector3d first, last;  // departure to attachment, at the start and at the end
  double bend_m = 0;     // the arc is nowhere farther from its chord: |arm across the axis| angle² / 8
};

/// V = det(d_i, d_j, a_j - a_i) = c0 + c1 τ + c2 τ² while both ends move along chords.
struct Coplanarity {
  double c0, c1, c2;
  Coplanarity(const Vector3d& i0, const Vector3d& i1, const Vector3d& j0, const Vector3d& j1, const Vector3d& e) {
    const Vector3d di = i1 - i0, dj = j1 - j0, ei = e.cross(i0), edi = e.cross(di);
    c0 = ei.dot(j0), c1 = ei.dot(dj) + edi.dot(j0), c2 = edi.dot(dj);
  }
  /// The least |V| on [0, 1]; 0 where it changes its sign.
  double least() const {
    const double end = c0 + c1 + c2;
    if ((c0 > 0) != (end > 0)) return 0;
    double value = std::min(std::abs(c0), std::abs(end));
    if (const double top = -c1, bottom = 2 * c2; (bottom > 0 ? top > 0 && top < bottom : top < 0 && top > bottom)) {
      const double middle = c0 - c1 * c1 / (4 * c2);
      if ((middle > 0) != (c0 > 0)) return 0;
      value = std::min(value, std::abs(middle));
    }
    return value;
  }
  /// Roots in [0, 1), ascending; their number.
  int roots(double out[2]) const {
    int count = 0;
    const auto add = [&](double t) {
      if (t >= 0 && t < 1) out[count++] = t;
    };
    const double d = c1 * c1 - 4 * c0 * c2;
    if (d < 0) return 0;
    const double q = -0.5 * (c1 + std::copysign(std::sqrt(d), c1));  // no cancellation
    if (c2 != 0) add(q / c2);
    if (q != 0 && d > 0) add(c0 / q);
    if (count == 2 && out[0] > out[1]) std::swap(out[0], out[1]);
    return count;
  }
};

/// Whether the cables meet inside both, given that they lie in one plane.
bool meet(const Vector3d& di, const Vector3d& dj, const Vector3d& e) {
  const Vector3d n = di.cross(dj);
  const double n2 = n.squaredNorm();
  const double s = e.cross(dj).dot(n), t = e.cross(di).dot(n);
  return s > 0 && s < n2 && t > 0 && t < n2;
}

class Pair {
 public:
  Pair(const Way& way, const Arm& i, const Arm& j, const Vector3d& ai, const Vector3d& aj)
      : way_(way), i_(i), j_(j), ai_(ai), aj_(aj), e_(aj - ai) {}

  /// The first crossing; nullopt if there is none before `until`.
  std::optional<double> first(double until) const {
    const std::optional<double> t = search(0, 1, i_.first, i_.last, j_.first, j_.last, until);
    return t && *t < until ? t : std::nullopt;
  }

 private:
  std::optional<double> search(double t0, double t1, const Vector3d& i0, const Vector3d& i1, const Vector3d& j0,
                               const Vector3d& j1, double until) const {
    if (t0 >= until) return std::nullopt;
    const Coplanarity v(i0, i1, j0, j1, e_);
    const double share = (t1 - t0) * (t1 - t0), bi = i_.bend_m * share, bj = j_.bend_m * share;
    // V changes by at most |e| (|d_i| b_j + |d_j| b_i + b_i b_j) from the chords to the arcs.
    const double li = std::sqrt(std::max(i0.squaredNorm(), i1.squaredNorm()));
    const double lj = std::sqrt(std::max(j0.squaredNorm(), j1.squaredNorm()));
    const double bound = e_.norm() * (li * bj + lj * bi + bi * bj);
    if (v.least() > bound) return std::nullopt;
    if (bi <= kChord_m && bj <= kChord_m) return on_chords(v, t0, t1, i0, i1, j0, j1);
    // No point of a cable goes farther from its place at half time than its end does from the chord's middle.
    const internal::Segment a{ai_, ai_ + 0.5 * (i0 + i1)}, b{aj_, aj_ + 0.5 * (j0 + j1)};
    const double reach = 0.5 * ((i1 - i0).norm() + (j1 - j0).norm()) + bi + bj;
    if (internal::distance(a, b) > reach) return std::nullopt;
    const double middle = 0.5 * (t0 + t1);
    const Vector3d im = way_.at(i_.arm, middle) - ai_, jm = way_.at(j_.arm, middle) - aj_;
    if (const auto early = search(t0, middle, i0, im, j0, jm, until)) return early;
    return search(middle, t1, im, i1, jm, j1, until);
  }

  std::optional<double> on_chords(const Coplanarity& v, double t0, double t1, const Vector3d& i0, const Vector3d& i1,
                                  const Vector3d& j0, const Vector3d& j1) const {
    const double size = e_.norm() * i0.norm() * j0.norm();
    if (std::abs(v.c0) + std::abs(v.c1) + std::abs(v.c2) <= 1e-13 * size) {
      // In one plane all the way: they cross if they come to lie across each other.
      if (!meet(i0, j0, e_) && meet(i1, j1, e_)) return 0.5 * (t0 + t1);
      return std::nullopt;
    }
    double roots[2];
    const int count = v.roots(roots);
    for (int k = 0; k < count; ++k)
      if (meet(i0 + roots[k] * (i1 - i0), j0 + roots[k] * (j1 - j0), e_)) return t0 + roots[k] * (t1 - t0);
    return std::nullopt;
  }

  const Way& way_;
  const Arm &i_, &j_;
  const Vector3d &ai_, &aj_;
  Vector3d e_;
};

}  // namespace

std::optional<Crossing> first_crossing(const Mechanism& mechanism, const Pose& from, const Pose& to) {
  internal::need_usable(mechanism, from);
  internal::need_usable(mechanism, to);
  const Way way(from, to);
  const std::size_t n = mechanism.cables.size();
  std::array<Arm, 12> arms;
  const Eigen::Matrix3d q = from.rotation.toRotationMatrix();
  const double c = std::cos(way.angle), s = std::sin(way.angle);
  for (std::size_t i = 0; i < n; ++i) {
    const Cable& cable = mechanism.cables[i];
    Arm& arm = arms[i];
    arm.arm = q * cable.attachment;
    arm.first = from.translation + arm.arm - cable.departure;
    if (way.angle == 0) {
      arm.last = arm.first + way.travel;
      continue;
    }
    const double along = way.axis.dot(arm.arm);
    arm.last =
        to.translation - cable.departure + c * arm.arm + s * way.axis.cross(arm.arm) + (1 - c) * along * way.axis;
    arm.bend_m = (arm.arm - along * way.axis).norm() * way.angle * way.angle / 8;
  }
  std::optional<Crossing> result;
  double until = 1;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = i + 1; k < n; ++k) {
      const Cable &a = mechanism.cables[i], &b = mechanism.cables[k];
      if (internal::same_point(a.attachment, b.attachment) || internal::same_point(a.departure, b.departure)) continue;
      if (const auto at = Pair(way, arms[i], arms[k], a.departure, b.departure).first(until)) {
        until = *at;
        result = Crossing{int(i), int(k), until};
      }
    }
  return result;
}

}  // namespace lumihull::capture
