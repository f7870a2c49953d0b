// The mapper for C++, without ROS: what the node and its test share. One buffer for each mapper; errors are exceptions with the library's sentences.
#pragma once

#include "dynvox.h"

#include <array>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace dynvox_ros2 {

inline void check(DynvoxStatus status, const std::string &what) {
  if (status != DYNVOX_STATUS_OK) throw std::runtime_error(what + ": " + dynvox_status_text(status));
}

// The rig of two rectified cameras by their projection matrices, as CameraInfo has them: p[3] of the right one is -focal length times baseline.
inline DynvoxRig rig_of(const std::array<double, 12> &left, const std::array<double, 12> &right) {
  const DynvoxRig rig{left[0], left[2], left[6], (left[3] - right[3]) / left[0]};
  if (!(rig.focal_px > 0.0) || !(rig.baseline_m > 0.0))
    throw std::runtime_error("the projection matrices are not those of a rectified pair: check both camera_info topics, left and right");
  return rig;
}

// Grey of three bytes a pixel, by ITU-R BT.601 in integers as the readers of dynvox compute it. `red` is 0 for RGB and 2 for BGR.
inline std::vector<uint8_t> grey_of(const uint8_t *pixels, size_t width, size_t height, size_t step_bytes, size_t red) {
  std::vector<uint8_t> grey(width * height);
  for (size_t v = 0; v < height; ++v)
    for (size_t u = 0; u < width; ++u) {
      const uint8_t *pixel = pixels + v * step_bytes + 3 * u;
      grey[v * width + u] = static_cast<uint8_t>((77u * pixel[red] + 150u * pixel[1] + 29u * pixel[2 - red] + 128u) >> 8);
    }
  return grey;
}

struct Point {
  float x, y, z;
  std::array<uint8_t, 3> colour;
};

class Mapper {
 public:
  // Divides `bytes` of memory for images of a size. Settings are key and value, as in a run's config.toml.
  Mapper(const DynvoxRig &rig, size_t width, size_t height, size_t bytes, const std::vector<std::pair<std::string, std::string>> &settings) {
    DynvoxConfig config;
    check(dynvox_config_default(&rig, &config), "the rig cannot be used");
    // No detector is needed: what moves is found by its motion, unless a setting says otherwise.
    check(dynvox_config_set(&config, "segmentation.enabled", "true"), "motion segmentation");
    for (const auto &[key, value] : settings) check(dynvox_config_set(&config, key.c_str(), value.c_str()), key + "=" + value);
    std::array<char, 200> problem{};
    check(dynvox_config_problem(&config, problem.data(), problem.size()), "the settings");
    if (problem[0] != '\0') throw std::runtime_error(std::string("the settings cannot be used: ") + problem.data());
    DynvoxBudget budget{};
    budget.bytes = bytes;
    budget.width = width;
    budget.height = height;
    DynvoxCapacity capacity;
    size_t least = 0;
    const DynvoxStatus divided = dynvox_capacity_for_budget(&budget, &capacity, &least);
    if (divided == DYNVOX_STATUS_TOO_SMALL) throw std::runtime_error("too few bytes of memory: at least " + std::to_string(least) + " are needed");
    check(divided, "the memory cannot be divided");
    const size_t alignment = dynvox_alignment();
    const size_t size = (bytes + alignment - 1) / alignment * alignment;
    memory_.reset(static_cast<uint8_t *>(std::aligned_alloc(alignment, size)));
    if (!memory_) throw std::bad_alloc();
    // A window of pruning is as long as the memory remembers.
    if (capacity.history_frames < 40)
      check(dynvox_config_set(&config, "volume.prune_lag", std::to_string(capacity.history_frames).c_str()), "the pruning window");
    check(dynvox_create(&capacity, &config, memory_.get(), size, &mapper_), "no mapper");
    picture_pixels_ = width * height;
  }

  Mapper(const Mapper &) = delete;
  Mapper &operator=(const Mapper &) = delete;
  ~Mapper() { dynvox_destroy(mapper_); }

  DynvoxReport step(const DynvoxFrame &frame) {
    DynvoxReport report;
    check(dynvox_step(mapper_, &frame, nullptr, &report), "the pair was refused");
    return report;
  }

  // Points of the static map that the camera sees, every `stride`-th column and row, in the camera's axes.
  std::vector<Point> seen(const DynvoxPose &t_world_camera, const DynvoxRig &rig, size_t stride) {
    std::vector<float> depth_m(picture_pixels_);
    std::vector<uint8_t> colour(3 * picture_pixels_);
    DynvoxPicture picture{};
    picture.capacity = picture_pixels_;
    picture.depth_m = depth_m.data();
    picture.colour = colour.data();
    check(dynvox_raycast(mapper_, &t_world_camera, &picture), "no view of the map");
    std::vector<Point> points;
    for (size_t v = 0; v < picture.height; v += stride)
      for (size_t u = 0; u < picture.width; u += stride) {
        const size_t at = v * picture.width + u;
        const float z = depth_m[at];
        if (z <= 0.0f) continue;
        const auto side = [z, &rig](size_t px, double center_px) { return static_cast<float>((static_cast<double>(px) - center_px) / rig.focal_px) * z; };
        points.push_back({side(u, rig.center_u_px), side(v, rig.center_v_px), z, {colour[3 * at], colour[3 * at + 1], colour[3 * at + 2]}});
      }
    return points;
  }

  std::vector<DynvoxTrack> tracks() {
    std::vector<DynvoxTrack> tracks(64);
    size_t count = 0;
    check(dynvox_tracks(mapper_, tracks.data(), tracks.size(), &count), "no tracks");
    tracks.resize(count < tracks.size() ? count : tracks.size());
    return tracks;
  }

 private:
  struct Free {
    void operator()(uint8_t *memory) const { std::free(memory); }
  };
  std::unique_ptr<uint8_t, Free> memory_;
  DynvoxMapper *mapper_ = nullptr;
  size_t picture_pixels_ = 0;
};

}  // namespace dynvox_ros2
