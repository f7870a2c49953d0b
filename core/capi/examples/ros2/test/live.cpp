// Plays a clip to the node at 10 Hz, as two cameras would, and compares what it says with the
// mapper's own digests: live CLIP MINUTES WALL. With WALL 1 time passes as on a clock; with 0 the
// next pair comes when the last one is mapped.
#include "clip.hpp"
#include "dynvox_ros2/node.hpp"

#include <rclcpp_components/register_node_macro.hpp>

#include <atomic>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

namespace {

using namespace dynvox_ros2;
using rclcpp::stub::publish;
using rclcpp::stub::subscribe;

constexpr int64_t PERIOD_NS = 100000000;
constexpr size_t MEMORY_MIB = 24;

int failures = 0;

void require(bool holds, const std::string &what) {
  if (holds) return;
  std::fprintf(stderr, "%s\n", what.c_str());
  ++failures;
}

// The clip to and fro: no frame jumps.
size_t position(uint64_t frame, size_t count) {
  const size_t around = 2 * (count - 1), at = static_cast<size_t>(frame % around);
  return at < count ? at : around - at;
}

int64_t stamp_ns(uint64_t frame) {
  return int64_t{1000000000} + static_cast<int64_t>(frame) * PERIOD_NS;
}

template <typename Message>
void set_header(Message &message, uint64_t frame, const char *frame_id) {
  message.header.stamp.sec = static_cast<int32_t>(stamp_ns(frame) / 1000000000);
  message.header.stamp.nanosec = static_cast<uint32_t>(stamp_ns(frame) % 1000000000);
  message.header.frame_id = frame_id;
}

struct Rig {
  const Clip &clip;

  void send_image(uint64_t frame, bool is_left) const {
    auto image = std::make_shared<Image>();
    set_header(*image, frame, is_left ? "left_optical" : "right_optical");
    image->width = clip.width;
    image->height = clip.height;
    image->encoding = "mono8";
    image->step = clip.width;
    const ClipFrame &seen = clip.frames[position(frame, clip.frames.size())];
    const uint8_t *pixels = is_left ? seen.left : seen.right;
    image->data.assign(pixels, pixels + size_t{clip.width} * clip.height);
    publish<Image>(is_left ? "/left/image_rect" : "/right/image_rect", std::move(image));
  }

  void send_info(uint64_t frame, bool is_left) const {
    auto info = std::make_shared<CameraInfo>();
    set_header(*info, frame, is_left ? "left_optical" : "right_optical");
    info->width = clip.width;
    info->height = clip.height;
    const DynvoxRig &rig = clip.rig;
    const double shift = is_left ? 0.0 : -rig.focal_px * rig.baseline_m;
    info->p = {rig.focal_px, 0, rig.center_u_px, shift, 0, rig.focal_px, rig.center_v_px, 0, 0, 0,
               1, 0};
    publish<CameraInfo>(is_left ? "/left/camera_info" : "/right/camera_info", std::move(info));
  }
};

// The digests that the mapper gives without any node.
std::vector<uint64_t> expected_digests(const Clip &clip, uint64_t frames) {
  MapperOptions options;
  options.bytes = MEMORY_MIB << 20;
  options.window = {60, 60, 16};
  Mapper mapper({clip.rig, clip.width, clip.height, {}}, options);
  std::vector<uint64_t> digests;
  for (uint64_t frame = 0; frame < frames; ++frame) {
    const ClipFrame &seen = clip.frames[position(frame, clip.frames.size())];
    const uint64_t time_ns = static_cast<uint64_t>(stamp_ns(frame));
    DynvoxFrame pair{};
    pair.width = clip.width;
    pair.height = clip.height;
    pair.left = {seen.left, clip.width};
    pair.right = {seen.right, clip.width};
    pair.time_ns = &time_ns;
    digests.push_back(mapper.step(pair).digest);
  }
  return digests;
}

// What the node published.
struct Heard {
  std::vector<uint64_t> digests;
  uint64_t odometry = 0, transforms = 0, grids = 0, objects = 0, clouds = 0, cells_known = 0;
  double farthest_m = 0, widest_m = 0;
};

template <typename Message, typename Callback>
auto hear(const std::string &topic, Callback callback) {
  return subscribe<Message>(topic, 1000, callback);
}

// Sends every camera's images from a thread of its own; the right camera is a little later.
void play(const Rig &rig, uint64_t frames, bool is_left, const std::atomic<bool> &is_wall,
          const std::atomic<uint64_t> &mapped) {
  const auto start = std::chrono::steady_clock::now();
  for (uint64_t frame = 0; frame < frames; ++frame) {
    if (is_wall) {
      const auto late = std::chrono::milliseconds(is_left ? 0 : 3);
      std::this_thread::sleep_until(start + std::chrono::nanoseconds(frame * PERIOD_NS) + late);
    } else {
      while (mapped < frame) std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    rig.send_info(frame, is_left);
    rig.send_image(frame, is_left);
  }
}

void check_outputs(const Heard &heard, uint64_t frames) {
  require(heard.odometry == frames && heard.transforms == frames, "odometry of every frame");
  require(heard.grids == frames && heard.objects == frames, "a grid and objects of every frame");
  require(heard.clouds == (frames + 4) / 5, "a cloud of every fifth frame");
  require(heard.cells_known > 100, "the grid knows cells");
  require(heard.farthest_m > 1.0 && heard.farthest_m < 60.0, "the camera drove to and fro");
  require(heard.widest_m > 0.0 && heard.widest_m < 100.0, "the covariance grows within bounds");
}

}  // namespace

int main(int argc, char **argv) {
  if (argc != 4) return std::fprintf(stderr, "live CLIP MINUTES WALL\n"), 1;
  const Clip clip = read_clip(argv[1]);
  const uint64_t frames = static_cast<uint64_t>(std::lround(600 * std::atof(argv[2])));
  const std::atomic<bool> is_wall{argv[3][0] == '1'};
  const std::vector<uint64_t> expected = expected_digests(clip, frames);

  rclcpp::NodeOptions parameters;
  parameters.overrides["memory_mib"] = static_cast<int64_t>(MEMORY_MIB);
  parameters.overrides["window"] = std::vector<int64_t>{60, 60, 16};
  const auto node = make_component(parameters);
  rclcpp::stub::spin_until([&] { return node->get_current_state().label() == "active"; });

  Heard heard;
  std::atomic<uint64_t> mapped{0};
  const auto odometry = hear<nav_msgs::msg::Odometry>(
      "/dynvox_mapper/odometry", [&](nav_msgs::msg::Odometry::ConstSharedPtr message) {
        ++heard.odometry;
        const auto &at = message->pose.pose.position;
        heard.farthest_m = std::max(heard.farthest_m, std::hypot(at.x, at.y));
        heard.widest_m = std::max(heard.widest_m, std::sqrt(message->pose.covariance[0]));
      });
  const auto transforms = hear<tf2_msgs::msg::TFMessage>(
      "/tf", [&](tf2_msgs::msg::TFMessage::ConstSharedPtr) { ++heard.transforms; });
  const auto grids = hear<nav_msgs::msg::OccupancyGrid>(
      "/dynvox_mapper/grid", [&](nav_msgs::msg::OccupancyGrid::ConstSharedPtr grid) {
        ++heard.grids;
        for (const int8_t cell : grid->data) heard.cells_known += cell >= 0;
      });
  const auto objects = hear<vision_msgs::msg::Detection3DArray>(
      "/dynvox_mapper/objects",
      [&](vision_msgs::msg::Detection3DArray::ConstSharedPtr) { ++heard.objects; });
  const auto clouds = hear<sensor_msgs::msg::PointCloud2>(
      "/dynvox_mapper/points",
      [&](sensor_msgs::msg::PointCloud2::ConstSharedPtr) { ++heard.clouds; });
  const auto diagnostics = hear<diagnostic_msgs::msg::DiagnosticArray>(
      "/diagnostics", [&](diagnostic_msgs::msg::DiagnosticArray::ConstSharedPtr message) {
        for (const auto &value : message->status[0].values)
          if (value.key == "digest")
            heard.digests.push_back(std::strtoull(value.value.c_str(), nullptr, 16));
        ++mapped;
      });

  // Cameras say what they are before they show anything: earlier pairs cannot be measured.
  const Rig rig{clip};
  rig.send_info(0, true);
  rig.send_info(0, false);
  while (rclcpp::stub::spin_once()) continue;
  std::thread left([&] { play(rig, frames, true, is_wall, mapped); });
  std::thread right([&] { play(rig, frames, false, is_wall, mapped); });
  const auto start = std::chrono::steady_clock::now();
  const auto patience = std::chrono::seconds(frames / 10 + 300);
  rclcpp::stub::spin_until([&] {
    return mapped >= frames || std::chrono::steady_clock::now() - start > patience;
  });
  left.join();
  right.join();

  check_outputs(heard, frames);
  require(rclcpp::stub::bus().lost == 0, "messages that queues had no room for");
  require(heard.digests == expected, "digests of every frame, in order");
  std::fprintf(stderr, "%zu of %" PRIu64 " frames mapped, %" PRIu64 " messages lost\n",
               heard.digests.size(), frames, rclcpp::stub::bus().lost);
  return failures;
}
