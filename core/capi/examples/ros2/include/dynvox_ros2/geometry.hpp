// Rigid motions between frames of reference, and how errors pass through them.
#pragma once

#include "dynvox.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include <tf2_msgs/msg/tf_message.hpp>

namespace dynvox_ros2 {

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;
// Row by row: translation before rotation, as messages have it.
using Covariance = std::array<std::array<double, 6>, 6>;

inline Vector operator+(const Vector &a, const Vector &b) {
  return {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
}

inline Vector operator*(const Matrix &m, const Vector &v) {
  Vector product{};
  for (size_t row = 0; row < 3; ++row)
    product[row] = m[row][0] * v[0] + m[row][1] * v[1] + m[row][2] * v[2];
  return product;
}

inline Matrix transposed(const Matrix &m) {
  return {{{m[0][0], m[1][0], m[2][0]}, {m[0][1], m[1][1], m[2][1]}, {m[0][2], m[1][2], m[2][2]}}};
}

inline Matrix operator*(const Matrix &a, const Matrix &b) {
  const Matrix columns = transposed(b);
  return transposed({a * columns[0], a * columns[1], a * columns[2]});
}

// Rotation and translation, m: maps coordinates of one frame to those of another.
struct Rigid {
  Matrix rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vector translation{};

  Vector operator*(const Vector &point) const { return rotation * point + translation; }

  Rigid operator*(const Rigid &inner) const {
    return {rotation * inner.rotation, *this * inner.translation};
  }

  Rigid inverse() const {
    const Matrix back = transposed(rotation);
    const Vector there = back * translation;
    return {back, {-there[0], -there[1], -there[2]}};
  }
};

// Rotation of a quaternion w, x, y, z of length 1.
inline Matrix rotation_of(const std::array<double, 4> &q) {
  const auto [w, x, y, z] = q;
  return {{{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
           {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
           {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}}};
}

// Quaternion w, x, y, z of a rotation, w not negative.
inline std::array<double, 4> quaternion_of(const Matrix &m) {
  const double trace = m[0][0] + m[1][1] + m[2][2];
  // The largest of the four is found first: dividing by it loses nothing.
  size_t axis = 0;
  for (size_t other = 1; other < 3; ++other)
    if (m[other][other] > m[axis][axis]) axis = other;
  std::array<double, 4> q{};
  if (trace > m[axis][axis]) {
    const double s = 2 * std::sqrt(1 + trace);
    q = {s / 4, (m[2][1] - m[1][2]) / s, (m[0][2] - m[2][0]) / s, (m[1][0] - m[0][1]) / s};
  } else {
    const size_t j = (axis + 1) % 3, k = (axis + 2) % 3;
    const double s = 2 * std::sqrt(1 + m[axis][axis] - m[j][j] - m[k][k]);
    q[0] = (m[k][j] - m[j][k]) / s;
    q[axis + 1] = s / 4;
    q[j + 1] = (m[j][axis] + m[axis][j]) / s;
    q[k + 1] = (m[k][axis] + m[axis][k]) / s;
  }
  const double sign = q[0] < 0 ? -1 : 1;
  for (double &part : q) part *= sign;
  return q;
}

// Pose of the C interface.
inline Rigid rigid_of(const DynvoxPose &pose) {
  Rigid rigid;
  rigid.rotation =
      rotation_of({pose.rotation[0], pose.rotation[1], pose.rotation[2], pose.rotation[3]});
  rigid.translation = {pose.translation_m[0], pose.translation_m[1], pose.translation_m[2]};
  return rigid;
}

inline DynvoxPose pose_of(const Rigid &rigid) {
  const auto q = quaternion_of(rigid.rotation);
  DynvoxPose pose{};
  for (size_t part = 0; part < 4; ++part) pose.rotation[part] = q[part];
  for (size_t axis = 0; axis < 3; ++axis) pose.translation_m[axis] = rigid.translation[axis];
  return pose;
}

// Covariance of a small motion in the axes of another frame: `to_from` maps this frame's
// coordinates to the other's, and a rotation moves the other's origin by the lever between them.
inline Covariance moved(const Covariance &covariance, const Rigid &to_from) {
  const Matrix &r = to_from.rotation;
  const Vector &t = to_from.translation;
  const Matrix lever = Matrix{{{0, -t[2], t[1]}, {t[2], 0, -t[0]}, {-t[1], t[0], 0}}} * r;
  Covariance jacobian{}, half{}, result{};
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column) {
      jacobian[row][column] = jacobian[row + 3][column + 3] = r[row][column];
      jacobian[row][column + 3] = lever[row][column];
    }
  for (size_t row = 0; row < 6; ++row)
    for (size_t column = 0; column < 6; ++column)
      for (size_t k = 0; k < 6; ++k) half[row][column] += jacobian[row][k] * covariance[k][column];
  for (size_t row = 0; row < 6; ++row)
    for (size_t column = 0; column < 6; ++column)
      for (size_t k = 0; k < 6; ++k) result[row][column] += half[row][k] * jacobian[column][k];
  return result;
}

// Transforms that never change, as /tf_static has them.
class StaticFrames {
 public:
  void add(const tf2_msgs::msg::TFMessage &message) {
    for (const auto &one : message.transforms) {
      const auto &q = one.transform.rotation;
      const auto &t = one.transform.translation;
      Link link{one.header.frame_id, {rotation_of({q.w, q.x, q.y, q.z}), {t.x, t.y, t.z}}};
      links_[one.child_frame_id] = link;
    }
  }

  // Maps coordinates of `child` to those of `parent`, if a chain of links leads from one up to
  // the other.
  std::optional<Rigid> find(const std::string &parent, const std::string &child) const {
    Rigid chain;
    std::string at = child;
    for (size_t step = 0; step <= links_.size(); ++step) {
      if (at == parent) return chain;
      const auto link = links_.find(at);
      if (link == links_.end()) return std::nullopt;
      chain = link->second.parent_child * chain;
      at = link->second.parent;
    }
    return std::nullopt;
  }

  // Maps coordinates of `from` to those of `to`, if chains lead from both up to one frame.
  std::optional<Rigid> between(const std::string &to, const std::string &from) const {
    Rigid ancestor_to;
    std::string at = to;
    for (size_t step = 0; step <= links_.size(); ++step) {
      if (const auto ancestor_from = find(at, from)) return ancestor_to.inverse() * *ancestor_from;
      const auto link = links_.find(at);
      if (link == links_.end()) return std::nullopt;
      ancestor_to = link->second.parent_child * ancestor_to;
      at = link->second.parent;
    }
    return std::nullopt;
  }

 private:
  struct Link {
    std::string parent;
    Rigid parent_child;
  };
  std::map<std::string, Link> links_;
};

}  // namespace dynvox_ros2
