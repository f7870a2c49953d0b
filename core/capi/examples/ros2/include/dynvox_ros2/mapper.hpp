// The mapper for C++: one buffer for each mapper; errors are exceptions with the library's
// sentences.
#pragma once

#include "dynvox.h"

#include <array>
#include <cstdlib>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace dynvox_ros2 {

inline void check(DynvoxStatus status, const std::string &what) {
  if (status == DYNVOX_STATUS_OK) return;
  throw std::runtime_error(what + ": " + dynvox_status_text(status));
}

// Cameras and the size of their images, px. Pairs are raw where `raw` is there; frames bring
// samples where `unit` is.
struct Cameras {
  DynvoxRig rig;
  size_t width, height;
  std::optional<DynvoxRawRig> raw;
  std::optional<DynvoxInertialUnit> unit = std::nullopt;
};

struct MapperOptions {
  // Bytes of memory, divided for the images' size.
  size_t bytes = size_t{256} << 20;
  // The planner's window: columns to the right and ahead, cells upwards. 0: none.
  std::array<size_t, 3> window{};
  // Keyframes by which places are recognised and loops closed; 0: none.
  size_t keyframes = 0;
  // Key and value, as in a run's config.toml.
  std::vector<std::pair<std::string, std::string>> settings;
};

// A point of the map in the camera's axes, m.
struct Point {
  float x, y, z;
  std::array<uint8_t, 3> colour;
};

// The planner's window: rows from the nearest ahead, in each from left to right; 0 unknown, 1 free,
// 2 occupied.
struct Window {
  DynvoxWindow place{};
  std::vector<uint8_t> state;
};

class Mapper {
 public:
  Mapper(const Cameras &cameras, const MapperOptions &options) {
    DynvoxConfig config;
    if (cameras.raw) {
      check(dynvox_config_raw(&*cameras.raw, &config), "the calibration cannot be used");
    } else {
      check(dynvox_config_default(&cameras.rig, &config), "the rig cannot be used");
    }
    rig_ = config.rig;
    if (cameras.unit)
      check(dynvox_config_inertial(&*cameras.unit, &config), "the inertial unit cannot be used");
    // No detector is needed: what moves is found by its motion, unless a setting says otherwise.
    check(dynvox_config_set(&config, "segmentation.enabled", "true"), "motion segmentation");
    for (const auto &[key, value] : options.settings)
      check(dynvox_config_set(&config, key.c_str(), value.c_str()), key + "=" + value);
    std::array<char, 200> problem{};
    check(dynvox_config_problem(&config, problem.data(), problem.size()), "the settings");
    if (problem[0] != '\0')
      throw std::runtime_error(std::string("the settings cannot be used: ") + problem.data());
    const DynvoxCapacity capacity = capacity_of(cameras, options);
    // A window of pruning is as long as the memory remembers.
    if (capacity.history_frames < 40)
      check(dynvox_config_set(&config, "volume.prune_lag",
                              std::to_string(capacity.history_frames).c_str()),
            "the pruning window");
    const size_t alignment = dynvox_alignment();
    const size_t size = (options.bytes + alignment - 1) / alignment * alignment;
    memory_.reset(static_cast<uint8_t *>(std::aligned_alloc(alignment, size)));
    if (!memory_) throw std::bad_alloc();
    check(dynvox_create(&capacity, &config, memory_.get(), size, &mapper_), "no mapper");
    pixels_ = cameras.width * cameras.height;
    columns_ = capacity.planning_width * capacity.planning_length;
  }

  Mapper(const Mapper &) = delete;
  Mapper &operator=(const Mapper &) = delete;
  ~Mapper() { dynvox_destroy(mapper_); }

  // The rectified cameras.
  const DynvoxRig &rig() const { return rig_; }

  DynvoxReport step(const DynvoxFrame &frame) {
    DynvoxReport report;
    check(dynvox_step(mapper_, &frame, nullptr, &report), "the pair was refused");
    return report;
  }

  // Points of the static map that the camera sees, every `stride`-th column and row.
  std::vector<Point> seen(const DynvoxPose &t_world_camera, size_t stride) {
    std::vector<float> depth_m(pixels_);
    std::vector<uint8_t> colour(3 * pixels_);
    DynvoxPicture picture{};
    picture.capacity = pixels_;
    picture.depth_m = depth_m.data();
    picture.colour = colour.data();
    check(dynvox_raycast(mapper_, &t_world_camera, &picture), "no view of the map");
    const auto side = [this](float z, size_t px, double center_px) {
      return static_cast<float>((static_cast<double>(px) - center_px) / rig_.focal_px) * z;
    };
    std::vector<Point> points;
    for (size_t v = 0; v < picture.height; v += stride)
      for (size_t u = 0; u < picture.width; u += stride) {
        const size_t at = v * picture.width + u;
        const float z = depth_m[at];
        if (z <= 0.0f) continue;
        points.push_back({side(z, u, rig_.center_u_px), side(z, v, rig_.center_v_px), z,
                          {colour[3 * at], colour[3 * at + 1], colour[3 * at + 2]}});
      }
    return points;
  }

  // Triangles of the static map, in the mapper's world; at most `most` of them.
  std::vector<DynvoxTriangle> triangles(size_t most) {
    struct Taken {
      size_t most;
      std::vector<DynvoxTriangle> triangles;
    } taken{most, {}};
    const auto take = [](void *context, const DynvoxTriangle *triangle) {
      Taken &taken = *static_cast<Taken *>(context);
      if (taken.triangles.size() < taken.most) taken.triangles.push_back(*triangle);
    };
    check(dynvox_triangles(mapper_, take, &taken, nullptr), "no mesh");
    return std::move(taken.triangles);
  }

  std::vector<DynvoxTrack> tracks() {
    std::vector<DynvoxTrack> tracks(64);
    size_t count = 0;
    check(dynvox_tracks(mapper_, tracks.data(), tracks.size(), &count), "no tracks");
    tracks.resize(count < tracks.size() ? count : tracks.size());
    return tracks;
  }

  // The window around the camera, as it is now.
  Window window() {
    Window window;
    window.state.resize(columns_);
    window.place.columns_capacity = columns_;
    window.place.state = window.state.data();
    check(dynvox_update_planning_maps(mapper_, 0.0f, &window.place), "no window");
    return window;
  }

  // The moving objects of the last window.
  // From the world as driven to the one after all loops.
  DynvoxPose closed_world() {
    DynvoxPose change;
    check(dynvox_closed_world(mapper_, &change), "no closed world");
    return change;
  }

  std::vector<DynvoxMovingBox> moving_boxes() {
    std::vector<DynvoxMovingBox> boxes(64);
    size_t count = 0;
    check(dynvox_moving_boxes(mapper_, boxes.data(), boxes.size(), &count), "no boxes");
    boxes.resize(count < boxes.size() ? count : boxes.size());
    return boxes;
  }

 private:
  // Bounds that the bytes are enough for, the window's among them.
  static DynvoxCapacity capacity_of(const Cameras &cameras, const MapperOptions &options) {
    DynvoxBudget budget{};
    budget.bytes = options.bytes;
    budget.width = cameras.width;
    budget.height = cameras.height;
    if (cameras.raw) {
      budget.raw_width = cameras.raw->left.width;
      budget.raw_height = cameras.raw->left.height;
    }
    const DynvoxCapacity whole = divided(budget);
    const DynvoxCapacity with_window = widened(whole, options);
    const size_t taken = bytes_of(with_window) - bytes_of(whole);
    if (taken == 0) return whole;
    if (taken >= budget.bytes)
      throw std::runtime_error("too few bytes of memory: the window alone takes " +
                               std::to_string(taken));
    budget.bytes -= taken;
    return widened(divided(budget), options);
  }

  static DynvoxCapacity divided(const DynvoxBudget &budget) {
    DynvoxCapacity capacity;
    size_t least = 0;
    const DynvoxStatus status = dynvox_capacity_for_budget(&budget, &capacity, &least);
    if (status == DYNVOX_STATUS_TOO_SMALL)
      throw std::runtime_error("too few bytes of memory: at least " + std::to_string(least) +
                               " are needed");
    check(status, "the memory cannot be divided");
    return capacity;
  }

  static DynvoxCapacity widened(DynvoxCapacity capacity, const MapperOptions &options) {
    capacity.planning_width = options.window[0];
    capacity.planning_length = options.window[1];
    capacity.planning_height = options.window[2];
    capacity.keyframes = options.keyframes;
    return capacity;
  }

  static size_t bytes_of(const DynvoxCapacity &capacity) {
    size_t bytes = 0;
    check(dynvox_bytes(&capacity, &bytes), "the bounds");
    return bytes;
  }

  struct Free {
    void operator()(uint8_t *memory) const { std::free(memory); }
  };
  std::unique_ptr<uint8_t, Free> memory_;
  DynvoxMapper *mapper_ = nullptr;
  DynvoxRig rig_{};
  size_t pixels_ = 0, columns_ = 0;
};

}  // namespace dynvox_ros2
