// The part of the node that needs no ROS: a rig of projection matrices, colour pictures, steps, a view and tracks, and sentences of what is refused.
#include "dynvox_ros2/mapper.hpp"

#include <cstdio>

static int failures = 0;

static void require(bool holds, const char *what) {
  if (!holds) {
    std::fprintf(stderr, "%s\n", what);
    ++failures;
  }
}

template <typename Call>
static std::string refusal(Call call) {
  try {
    call();
  } catch (const std::exception &error) {
    return error.what();
  }
  return "";
}

int main() {
  constexpr size_t width = 320, height = 96, shift = 10;
  const std::array<double, 12> left_p{200, 0, 159.5, 0, 0, 200, 47.5, 0, 0, 0, 1, 0};
  std::array<double, 12> right_p = left_p;
  right_p[3] = -100;
  const DynvoxRig rig = dynvox_ros2::rig_of(left_p, right_p);
  require(rig.focal_px == 200 && rig.center_u_px == 159.5 && rig.center_v_px == 47.5 && rig.baseline_m == 0.5, "the rig of the projection matrices");
  require(refusal([&] { dynvox_ros2::rig_of(right_p, left_p); }).find("rectified pair") != std::string::npos, "exchanged cameras are refused");

  // A textured wall 10 px away, in colours of red alone.
  std::vector<uint8_t> left(3 * width * height), right(3 * width * height);
  for (size_t v = 0; v < height; ++v)
    for (size_t u = 0; u < width; ++u) {
      const uint8_t value = static_cast<uint8_t>((u / 3 * 2654435761u ^ v / 3 * 40503777u) >> 7);
      left[3 * (v * width + u)] = right[3 * (v * width + (u + width - shift) % width)] = value;
    }
  const std::vector<uint8_t> left_grey = dynvox_ros2::grey_of(left.data(), width, height, 3 * width, 0);
  const std::vector<uint8_t> right_grey = dynvox_ros2::grey_of(right.data(), width, height, 3 * width, 0);
  require(left_grey[0] == (77u * left[0] + 128) >> 8 && dynvox_ros2::grey_of(left.data(), 1, 1, 3, 2)[0] == (29u * left[0] + 128) >> 8, "grey of RGB and BGR");

  dynvox_ros2::Mapper mapper(rig, width, height, 8u << 20, {{"volume.voxel_size_m", "0.1"}});
  DynvoxFrame frame{};
  frame.width = width;
  frame.height = height;
  frame.left = {left_grey.data(), width};
  frame.right = {right_grey.data(), width};
  frame.colour = {left.data(), width};
  uint64_t time_ns = 1;
  frame.time_ns = &time_ns;
  DynvoxReport report{};
  for (int i = 0; i < 3; ++i, time_ns += 33333333) report = mapper.step(frame);
  const auto points = mapper.seen(report.t_world_camera, rig, 2);
  // 200 px x 0.5 m / 10 px.
  size_t near = 0;
  for (const auto &point : points) near += point.z > 9.5f && point.z < 10.5f;
  require(points.size() > 500 && near * 10 > points.size() * 9, "the wall is 10 m away");
  require(mapper.tracks().empty(), "nothing moves");
  require(refusal([&] { mapper.step(frame), mapper.step(frame); }).find("refused") != std::string::npos, "a pair of the same time is refused");
  require(refusal([&] { dynvox_ros2::Mapper(rig, width, height, 1 << 20, {}); }).find("at least") != std::string::npos, "too few bytes are refused with the least");
  require(refusal([&] { dynvox_ros2::Mapper(rig, width, height, 8u << 20, {{"volume.voxel_sise_m", "1"}}); }).find("voxel_sise_m") != std::string::npos, "an unknown setting is named");
  require(refusal([&] { dynvox_ros2::Mapper(rig, width, height, 8u << 20, {{"volume.voxel_size_m", "-1"}}); }).find("cannot be used") != std::string::npos, "a setting out of range is named");
  std::printf("%zu points\n", points.size());
  return failures;
}
