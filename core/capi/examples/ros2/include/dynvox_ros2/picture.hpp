// Images of messages as the mapper reads them.
#pragma once

#include "dynvox.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include <sensor_msgs/msg/image.hpp>

namespace dynvox_ros2 {

// Grey of pixels of three or four bytes, by ITU-R BT.601 in integers as the readers of dynvox
// compute it. `red` is the position of red in a pixel, 0 or 2.
inline std::vector<uint8_t> grey_of(const uint8_t *pixels, size_t width, size_t height,
                                    size_t step_bytes, size_t red, size_t channels = 3) {
  std::vector<uint8_t> grey(width * height);
  for (size_t v = 0; v < height; ++v)
    for (size_t u = 0; u < width; ++u) {
      const uint8_t *pixel = pixels + v * step_bytes + channels * u;
      const unsigned sum = 77u * pixel[red] + 150u * pixel[1] + 29u * pixel[2 - red] + 128u;
      grey[v * width + u] = static_cast<uint8_t>(sum >> 8);
    }
  return grey;
}

// The grey picture of a message, and its own colours where it is RGB. The message must outlive it:
// what need not be computed is not copied.
struct Picture {
  DynvoxImage grey{};
  DynvoxImage colour{};

  explicit Picture(const sensor_msgs::msg::Image &image) {
    const std::string &encoding = image.encoding;
    const size_t channels = channels_of(encoding);
    const uint64_t step = image.step;
    if (step < uint64_t{channels} * image.width || image.data.size() < step * image.height)
      throw std::runtime_error("an image is shorter than it says: check its driver");
    const uint8_t *pixels = image.data.data();
    if (channels == 1) {
      grey = {pixels, image.step};
    } else if (channels == 2) {
      // Of 16 bits the upper eight count.
      computed_ = upper_bytes(image);
      grey = {computed_.data(), image.width};
    } else {
      const size_t red = encoding[0] == 'b' ? 2 : 0;
      computed_ = grey_of(pixels, image.width, image.height, image.step, red, channels);
      grey = {computed_.data(), image.width};
      if (encoding == "rgb8" && image.step % 3 == 0) colour = {pixels, image.step / 3};
    }
  }

 private:
  static size_t channels_of(const std::string &encoding) {
    if (encoding == "mono8" || encoding == "8UC1") return 1;
    if (encoding == "mono16" || encoding == "16UC1") return 2;
    if (encoding == "rgb8" || encoding == "bgr8") return 3;
    if (encoding == "rgba8" || encoding == "bgra8") return 4;
    throw std::runtime_error("images are " + encoding +
                             ": give mono8, mono16, rgb8, bgr8, rgba8 or bgra8; image_proc "
                             "turns Bayer patterns into one of them");
  }

  static std::vector<uint8_t> upper_bytes(const sensor_msgs::msg::Image &image) {
    std::vector<uint8_t> upper(size_t{image.width} * image.height);
    const size_t high = image.is_bigendian ? 0 : 1;
    for (size_t v = 0; v < image.height; ++v)
      for (size_t u = 0; u < image.width; ++u)
        upper[v * image.width + u] = image.data[v * image.step + 2 * u + high];
    return upper;
  }

  std::vector<uint8_t> computed_;
};

// Disparities in 1/256 px of a depth image of the left camera: metres (32FC1) or millimetres
// (16UC1), 0 or NaN where unknown.
inline std::vector<uint16_t> disparity_of(const sensor_msgs::msg::Image &depth,
                                          const DynvoxRig &rig) {
  const bool is_metric = depth.encoding == "32FC1";
  if (!is_metric && depth.encoding != "16UC1" && depth.encoding != "mono16")
    throw std::runtime_error("depth is " + depth.encoding + ": give 32FC1 (m) or 16UC1 (mm)");
  const size_t bytes = is_metric ? 4 : 2;
  const uint64_t step = depth.step;
  if (depth.is_bigendian) throw std::runtime_error("depth is big-endian: give little-endian");
  if (step < uint64_t{bytes} * depth.width || depth.data.size() < step * depth.height)
    throw std::runtime_error("a depth image is shorter than it says: check its driver");
  std::vector<uint16_t> disparity(size_t{depth.width} * depth.height);
  for (size_t v = 0; v < depth.height; ++v)
    for (size_t u = 0; u < depth.width; ++u) {
      const uint8_t *at = depth.data.data() + v * depth.step + bytes * u;
      double depth_m = 0;
      if (is_metric) {
        float metres;
        std::memcpy(&metres, at, 4);
        depth_m = metres;
      } else {
        depth_m = 0.001 * (at[0] | at[1] << 8);
      }
      const double q8 = 256.0 * rig.focal_px * rig.baseline_m / depth_m;
      // NaN fails the comparison as well.
      if (depth_m > 0 && q8 < 65535.5) disparity[v * depth.width + u] =
          static_cast<uint16_t>(std::lround(q8));
    }
  return disparity;
}

}  // namespace dynvox_ros2
