// What belongs to a pair and comes on topics of its own: samples of an inertial unit, masks.
#pragma once

#include "dynvox.h"
#include "dynvox_ros2/pairing.hpp"

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <sensor_msgs/msg/image.hpp>
#include <sensor_msgs/msg/imu.hpp>

namespace dynvox_ros2 {

// Samples of an inertial unit since the last pair.
class InertialSamples {
 public:
  // Takes a sample; one that is not later than the last is dropped.
  void add(const sensor_msgs::msg::Imu &message) {
    const int64_t ns = time_ns(message);
    if (ns < 0 || (newest_ns_ && ns <= *newest_ns_)) return;
    newest_ns_ = ns;
    frame_ = message.header.frame_id;
    const auto &turn = message.angular_velocity;
    const auto &force = message.linear_acceleration;
    samples_.push_back(
        {static_cast<uint64_t>(ns), {turn.x, turn.y, turn.z}, {force.x, force.y, force.z}});
    // A second of the fastest units: more are not read of one frame.
    if (samples_.size() > 1024) samples_.pop_front();
  }

  // True once all samples up to this time are there.
  bool reach(int64_t ns) const { return newest_ns_ && *newest_ns_ >= ns; }

  // Frame of the unit's axes; empty before the first sample.
  const std::string &frame() const { return frame_; }

  // Takes the samples up to this time.
  std::vector<DynvoxInertialSample> take_until(int64_t ns) {
    std::vector<DynvoxInertialSample> taken;
    while (!samples_.empty() && samples_.front().time_ns <= static_cast<uint64_t>(ns)) {
      taken.push_back(samples_.front());
      samples_.pop_front();
    }
    return taken;
  }

 private:
  std::deque<DynvoxInertialSample> samples_;
  std::optional<int64_t> newest_ns_;
  std::string frame_;
};

// The latest images of one topic, found by their times.
class LatestImages {
 public:
  using Pointer = std::shared_ptr<const sensor_msgs::msg::Image>;

  LatestImages(int64_t slack_ns, size_t depth) : slack_ns_(slack_ns), depth_(depth) {}

  void add(Pointer image) {
    images_.push_back(std::move(image));
    if (images_.size() > depth_) images_.pop_front();
  }

  // The image of this time, or null.
  Pointer at(int64_t ns) const {
    for (const Pointer &image : images_)
      if (std::abs(time_ns(*image) - ns) <= slack_ns_) return image;
    return nullptr;
  }

  // True once the image of this time is there, or a later one: then it comes no more.
  bool reach(int64_t ns) const {
    return !images_.empty() && time_ns(*images_.back()) >= ns - slack_ns_;
  }

 private:
  int64_t slack_ns_;
  size_t depth_;
  std::deque<Pointer> images_;
};

// Masks of a picture whose pixels are numbers of instances: 0 none, else 1000 times the class, as
// DynvoxDetection counts it, plus a number. Numbers below 1000, all that mono8 has, are objects of
// no class.
class Instances {
 public:
  // The mapper takes this many of a frame.
  static constexpr size_t MOST = 64;

  explicit Instances(const sensor_msgs::msg::Image &image) {
    const size_t bytes = bytes_of(image);
    if (image.step < bytes * image.width || image.data.size() < size_t{image.step} * image.height)
      throw std::runtime_error("an image of instances is shorter than it says");
    const auto value = [&](size_t u, size_t v) -> uint16_t {
      const uint8_t *at = image.data.data() + v * image.step + bytes * u;
      if (bytes == 1) return at[0];
      const size_t high = image.is_bigendian ? 0 : 1;
      return static_cast<uint16_t>(at[high] << 8 | at[1 - high]);
    };
    std::map<uint16_t, Box> boxes;
    for (size_t v = 0; v < image.height; ++v)
      for (size_t u = 0; u < image.width; ++u)
        if (const uint16_t number = value(u, v)) boxes[number].grow(u, v);
    if (boxes.size() > MOST)
      throw std::runtime_error("an image shows " + std::to_string(boxes.size()) +
                               " instances: at most 64 are taken");
    for (const auto &[number, box] : boxes) {
      const size_t width = box.right + 1 - box.left, height = box.bottom + 1 - box.top;
      std::vector<uint8_t> mask(width * height);
      for (size_t v = 0; v < height; ++v)
        for (size_t u = 0; u < width; ++u)
          mask[v * width + u] = value(box.left + u, box.top + v) == number;
      masks_.push_back(std::move(mask));
      DynvoxDetection detection{};
      detection.class_code = static_cast<uint8_t>(number / 1000);
      detection.score = 1.0f;
      detection.left = static_cast<int32_t>(box.left);
      detection.top = static_cast<int32_t>(box.top);
      detection.width = static_cast<uint32_t>(width);
      detection.height = static_cast<uint32_t>(height);
      detection.mask = masks_.back().data();
      detections_.push_back(detection);
    }
  }

  // Valid as long as this is.
  const std::vector<DynvoxDetection> &detections() const { return detections_; }

 private:
  struct Box {
    size_t left = SIZE_MAX, top = SIZE_MAX, right = 0, bottom = 0;
    void grow(size_t u, size_t v) {
      left = std::min(left, u);
      right = std::max(right, u);
      top = std::min(top, v);
      bottom = std::max(bottom, v);
    }
  };

  static size_t bytes_of(const sensor_msgs::msg::Image &image) {
    if (image.encoding == "mono8" || image.encoding == "8UC1") return 1;
    if (image.encoding == "mono16" || image.encoding == "16UC1") return 2;
    throw std::runtime_error("instances are " + image.encoding + ": give mono8 or 16UC1");
  }

  // A deque's items stay where they are.
  std::deque<std::vector<uint8_t>> masks_;
  std::vector<DynvoxDetection> detections_;
};

}  // namespace dynvox_ros2
