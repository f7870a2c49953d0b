// The cameras as CameraInfo describes them.
#pragma once

#include "dynvox.h"
#include "dynvox_ros2/geometry.hpp"

#include <array>
#include <stdexcept>
#include <string>

#include <sensor_msgs/msg/camera_info.hpp>

namespace dynvox_ros2 {

// The rig of two rectified cameras by their projection matrices, as CameraInfo has them: p[3] of
// the right one is minus focal length times baseline.
inline DynvoxRig rig_of(const std::array<double, 12> &left, const std::array<double, 12> &right) {
  const DynvoxRig rig{left[0], left[2], left[6], (left[3] - right[3]) / left[0]};
  if (!(rig.focal_px > 0.0) || !(rig.baseline_m > 0.0))
    throw std::runtime_error(
        "the projection matrices are not those of a rectified pair: check both camera_info "
        "topics, left and right");
  return rig;
}

// A lens in the words of CameraInfo: distortion_model, k and d.
inline DynvoxRawCamera raw_camera_of(const sensor_msgs::msg::CameraInfo &info) {
  DynvoxRawCamera camera{};
  camera.width = info.width;
  camera.height = info.height;
  camera.focal_px[0] = info.k[0];
  camera.focal_px[1] = info.k[4];
  camera.center_px[0] = info.k[2];
  camera.center_px[1] = info.k[5];
  const std::string &model = info.distortion_model;
  const auto d = [&info](size_t at) { return at < info.d.size() ? info.d[at] : 0.0; };
  if (model == "plumb_bob" || model == "rational_polynomial" || model.empty()) {
    camera.model = DYNVOX_LENS_RADIAL_TANGENTIAL;
    // k1, k2, p1, p2, k3 to k6 there; k1 to k6, p1, p2 here.
    const double parameters[] = {d(0), d(1), d(4), d(5), d(6), d(7), d(2), d(3)};
    for (size_t at = 0; at < 8; ++at) camera.parameters[at] = parameters[at];
  } else if (model == "equidistant" || model == "fisheye") {
    camera.model = DYNVOX_LENS_EQUIDISTANT;
    for (size_t at = 0; at < 4; ++at) camera.parameters[at] = d(at);
  } else {
    throw std::runtime_error("the lens model " + model +
                             " is unknown here: give plumb_bob, rational_polynomial or "
                             "equidistant, or rectified images");
  }
  return camera;
}

// Two raw cameras. Their rectifying rotations say how they stand to each other.
inline DynvoxRawRig raw_rig_of(const sensor_msgs::msg::CameraInfo &left,
                               const sensor_msgs::msg::CameraInfo &right) {
  const DynvoxRig rectified = rig_of(left.p, right.p);
  DynvoxRawRig rig{};
  rig.left = raw_camera_of(left);
  rig.right = raw_camera_of(right);
  const auto matrix = [](const std::array<double, 9> &r) {
    return Matrix{{{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, {r[6], r[7], r[8]}}};
  };
  const Matrix raw_right = transposed(matrix(right.r));
  const Matrix right_left = raw_right * matrix(left.r);
  const Vector left_center = raw_right * Vector{-rectified.baseline_m, 0, 0};
  for (size_t row = 0; row < 3; ++row) {
    for (size_t column = 0; column < 3; ++column)
      rig.r_right_left[3 * row + column] = right_left[row][column];
    rig.t_right_left_m[row] = left_center[row];
  }
  rig.width = left.width;
  rig.height = left.height;
  rig.focal_px = rectified.focal_px;
  return rig;
}

}  // namespace dynvox_ros2
