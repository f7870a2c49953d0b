// The node without ROS: messages in, messages out. src/mapper_node.cpp connects it to topics.
#pragma once

#include "dynvox.h"
#include "dynvox_ros2/companions.hpp"
#include "dynvox_ros2/geometry.hpp"
#include "dynvox_ros2/mapper.hpp"
#include "dynvox_ros2/messages.hpp"
#include "dynvox_ros2/pairing.hpp"
#include "dynvox_ros2/picture.hpp"
#include "dynvox_ros2/rig.hpp"

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <nav_msgs/msg/odometry.hpp>
#include <sensor_msgs/msg/camera_info.hpp>
#include <sensor_msgs/msg/image.hpp>
#include <sensor_msgs/msg/imu.hpp>
#include <tf2_msgs/msg/tf_message.hpp>
#include <visualization_msgs/msg/marker.hpp>

namespace dynvox_ros2 {

using Image = sensor_msgs::msg::Image;
using CameraInfo = sensor_msgs::msg::CameraInfo;
using Imu = sensor_msgs::msg::Imu;

struct NodeOptions {
  MapperOptions mapper;
  // Name of the world; its axes are x ahead, y left, z up at the first picture.
  std::string map_frame = "map";
  // Name of the world after all loops, where the mapper has keyframes.
  std::string closed_frame = "closed_map";
  // Frame that the node moves in the map; empty: the left camera's own. /tf_static leads from it
  // to the camera.
  std::string base_frame;
  // Images are rectified already.
  bool rectified = true;
  // The right camera's images are depth images of the left camera: `pose` gives the motion then.
  bool depth = false;
  // Baseline of the stereo camera that such depth errs like, m.
  double depth_baseline_m = 0.1;
  // A pair waits for the samples of an inertial unit up to its time; /tf_static leads to the unit.
  bool imu = false;
  // A pair waits for the instances seen in its left image, and for the pixels not to be used.
  bool instances = false, ignored = false;
  // Times of a pair may differ by this much, s.
  double slack_s = 0.005;
  // Images of each camera that wait for their partner.
  size_t queue = 10;
  // Frames from one cloud, and from one grid, to the next; 0: none.
  uint32_t points_every = 5, grid_every = 1;
  // Columns and rows from one point to the next.
  size_t points_stride = 2;
  // Frames from one mesh of the whole map to the next, 0: none; and most triangles of it.
  uint32_t mesh_every = 0;
  size_t mesh_triangles = 200000;
};

// All that one pair gives.
struct Outputs {
  DynvoxReport report{};
  nav_msgs::msg::Odometry odometry;
  tf2_msgs::msg::TFMessage transforms;
  diagnostic_msgs::msg::DiagnosticArray diagnostics;
  std::optional<nav_msgs::msg::OccupancyGrid> grid;
  std::optional<vision_msgs::msg::Detection3DArray> objects;
  std::optional<sensor_msgs::msg::PointCloud2> points;
  std::optional<visualization_msgs::msg::Marker> mesh;
};

class Node {
 public:
  explicit Node(NodeOptions options)
      : options_(std::move(options)),
        pairs_(std::llround(1e9 * options_.slack_s), options_.queue),
        instances_(std::llround(1e9 * options_.slack_s), options_.queue),
        ignored_(std::llround(1e9 * options_.slack_s), options_.queue) {}

  void left_info(const CameraInfo &info) { left_info_ = info; }
  void right_info(const CameraInfo &info) { right_info_ = info; }
  void static_frames(const tf2_msgs::msg::TFMessage &message) { frames_.add(message); }

  // Pose of the base frame in the map by another estimator. From the first one on it replaces the
  // node's own egomotion: a pair waits for none, it takes the last pose that is not newer.
  void pose(const nav_msgs::msg::Odometry &odometry) { pose_ = odometry; }

  // An image of the left camera. Returns what the pair gives that is complete by it.
  std::optional<Outputs> left(Image::ConstSharedPtr image) {
    return completed(pairs_.left(std::move(image)));
  }

  // An image of the right camera, or a depth image where the options say so.
  std::optional<Outputs> right(Image::ConstSharedPtr image) {
    return completed(pairs_.right(std::move(image)));
  }

  // A sample of the inertial unit, for which a pair may have waited.
  std::optional<Outputs> imu(const Imu &sample) {
    samples_.add(sample);
    return completed(std::nullopt);
  }

  // Numbers of the instances that a detector saw in a left image; see Instances.
  std::optional<Outputs> instances(Image::ConstSharedPtr image) {
    instances_.add(std::move(image));
    return completed(std::nullopt);
  }

  // Pixels of a left image that are not used, any value but 0.
  std::optional<Outputs> ignored(Image::ConstSharedPtr image) {
    ignored_.add(std::move(image));
    return completed(std::nullopt);
  }

  // Pairs that were mapped, and those that were refused.
  uint64_t pairs_mapped() const { return pairs_mapped_; }
  uint64_t pairs_refused() const { return pairs_refused_; }
  // Images that found no partner.
  uint64_t unpaired() const { return pairs_.unpaired(); }
  // Pairs that were mapped without samples or images of theirs that did not come in time.
  uint64_t incomplete() const { return incomplete_; }

 private:
  using Pair = Pairing<Image>::Pair;

  // Maps the oldest pair if all of it is there, or if too many wait.
  std::optional<Outputs> completed(std::optional<Pair> pair) {
    if (pair) waiting_.push_back(std::move(*pair));
    if (waiting_.empty()) return std::nullopt;
    const bool is_complete = complete(time_ns(*waiting_.front().first));
    if (!is_complete && waiting_.size() <= options_.queue) return std::nullopt;
    if (!is_complete) ++incomplete_;
    const Pair oldest = std::move(waiting_.front());
    waiting_.pop_front();
    return mapped(oldest);
  }

  bool complete(int64_t ns) const {
    return (!options_.imu || samples_.reach(ns)) && (!options_.instances || instances_.reach(ns)) &&
           (!options_.ignored || ignored_.reach(ns));
  }

  std::optional<Outputs> mapped(const Pair &pair) {
    // Without both descriptions nothing can be measured: the cameras are just starting.
    if (!mapper_ && !(left_info_ && (right_info_ || options_.depth))) {
      ++pairs_refused_;
      return std::nullopt;
    }
    try {
      Outputs outputs = map(*pair.first, *pair.second);
      ++pairs_mapped_;
      return outputs;
    } catch (...) {
      ++pairs_refused_;
      throw;
    }
  }

  Outputs map(const Image &left, const Image &right) {
    if (left.width != right.width || left.height != right.height)
      throw std::runtime_error("the images of a pair differ in size: check both cameras");
    const Picture left_picture(left);
    std::optional<Picture> right_picture;
    if (!options_.depth) right_picture.emplace(right);
    if (!mapper_) begin(left);
    const uint64_t stamp_ns = static_cast<uint64_t>(time_ns(left));
    DynvoxFrame frame{};
    frame.width = left.width;
    frame.height = left.height;
    frame.left = left_picture.grey;
    // With depth given nothing is matched: the left image stands in.
    frame.right = right_picture ? right_picture->grey : left_picture.grey;
    std::vector<uint16_t> disparity;
    if (options_.depth) disparity = disparity_of(right, mapper_->rig());
    if (options_.depth) frame.disparity_q8 = disparity.data();
    frame.colour = left_picture.colour;
    frame.time_ns = &stamp_ns;
    // All of these live until the step has read them.
    const std::vector<DynvoxInertialSample> samples = samples_.take_until(time_ns(left));
    frame.inertial = samples.data();
    frame.inertial_count = samples.size();
    const std::optional<Instances> seen = instances_of(left);
    if (seen) {
      frame.detections = seen->detections().data();
      frame.detection_count = seen->detections().size();
    }
    const Image::ConstSharedPtr ignored = ignored_.at(time_ns(left));
    std::optional<Picture> ignored_picture;
    if (ignored) frame.ignored = ignored_picture.emplace(marks_of(*ignored, left)).grey;
    const std::optional<DynvoxPose> given = given_pose(left);
    if (options_.depth && !given) throw std::runtime_error("depth needs poses: publish pose");
    if (given) frame.t_world_camera = &*given;
    Outputs outputs;
    outputs.report = mapper_->step(frame);
    describe(left, outputs);
    last_ = {rigid_of(outputs.report.t_world_camera), stamp_ns, outputs.report.segment};
    return outputs;
  }

  std::optional<Instances> instances_of(const Image &left) const {
    const Image::ConstSharedPtr image = instances_.at(time_ns(left));
    if (!image) return std::nullopt;
    return Instances(marks_of(*image, left));
  }

  // An image that lies over the left one.
  static const Image &marks_of(const Image &image, const Image &left) {
    if (image.width != left.width || image.height != left.height)
      throw std::runtime_error("instances and ignored pixels have the size of the left image");
    return image;
  }

  // The inertial unit where /tf_static says it is.
  DynvoxInertialUnit unit_of(const Image &left) const {
    const auto camera_unit = frames_.between(left.header.frame_id, samples_.frame());
    if (!camera_unit)
      throw std::runtime_error("no static transforms lead from the inertial unit's frame " +
                               samples_.frame() + " to " + left.header.frame_id +
                               ": publish them, or set imu to false");
    // Raw images are rectified by a turn of their camera.
    Rigid rectified;
    if (!options_.rectified) {
      const auto &r = left_info_->r;
      rectified.rotation = {{{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, {r[6], r[7], r[8]}}};
    }
    DynvoxInertialUnit unit{};
    unit.t_camera_unit = pose_of(rectified * *camera_unit);
    return unit;
  }

  // Makes the mapper for images of this size.
  void begin(const Image &left) {
    const auto &p = left_info_->p;
    const DynvoxRig rig = options_.depth ? DynvoxRig{p[0], p[2], p[6], options_.depth_baseline_m}
                                         : rig_of(p, right_info_->p);
    Cameras cameras{rig, left.width, left.height, {}};
    if (!options_.rectified && !options_.depth) cameras.raw = raw_rig_of(*left_info_, *right_info_);
    if (options_.imu && !samples_.frame().empty()) cameras.unit = unit_of(left);
    mapper_ = std::make_unique<Mapper>(cameras, options_.mapper);
    has_window_ = options_.mapper.window[0] > 0;
    // The mapper's world has the axes of the first camera; the window knows which way is up.
    map_world_.rotation = {{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}}};
    if (has_window_) map_world_ = map_of_world(mapper_->window().place);
  }

  // The camera in the base frame.
  Rigid base_camera(const Image &left) const {
    if (options_.base_frame.empty()) return {};
    const auto found = frames_.find(options_.base_frame, left.header.frame_id);
    if (!found)
      throw std::runtime_error("no static transform leads from " + options_.base_frame + " to " +
                               left.header.frame_id + ": publish it, or leave base_frame empty");
    return *found;
  }

  // The pose of another estimator as the mapper's.
  std::optional<DynvoxPose> given_pose(const Image &left) const {
    if (!pose_) return std::nullopt;
    const auto &p = pose_->pose.pose.position;
    const auto &q = pose_->pose.pose.orientation;
    const Rigid map_base{rotation_of({q.w, q.x, q.y, q.z}), {p.x, p.y, p.z}};
    return pose_of(map_world_.inverse() * map_base * base_camera(left));
  }

  void describe(const Image &left, Outputs &outputs) {
    const DynvoxReport &report = outputs.report;
    Header map_header;
    map_header.stamp = left.header.stamp;
    map_header.frame_id = options_.map_frame;
    // Where another segment lies in the first is not known: it is a world of its own.
    if (report.segment > 0) map_header.frame_id += "_" + std::to_string(report.segment);
    describe_pose(left, map_header, outputs);
    const bool is_placed = report.pose_origin != DYNVOX_POSE_ORIGIN_EXTRAPOLATED;
    if (has_window_ && options_.grid_every > 0 && report.frame % options_.grid_every == 0) {
      outputs.grid = grid_message(map_header, mapper_->window(), is_placed);
      outputs.objects = objects_message(map_header, mapper_->moving_boxes(), mapper_->tracks());
    }
    if (options_.points_every > 0 && report.frame % options_.points_every == 0) {
      const size_t stride = options_.points_stride > 0 ? options_.points_stride : 1;
      outputs.points = points_message(left.header, mapper_->seen(report.t_world_camera, stride));
    }
    if (options_.mesh_every > 0 && report.frame % options_.mesh_every == 0)
      outputs.mesh =
          mesh_message(map_header, mapper_->triangles(options_.mesh_triangles), map_world_);
    describe_state(map_header, outputs);
  }

  void describe_pose(const Image &left, const Header &map_header, Outputs &outputs) {
    const DynvoxReport &report = outputs.report;
    const Rigid world_camera = rigid_of(report.t_world_camera);
    const Rigid base_camera = this->base_camera(left);
    const Rigid map_base = map_world_ * world_camera * base_camera.inverse();
    auto &odometry = outputs.odometry;
    odometry.header = map_header;
    odometry.child_frame_id =
        options_.base_frame.empty() ? left.header.frame_id : options_.base_frame;
    odometry.pose.pose = pose_message(map_base);
    const bool is_continued = last_ && last_->segment == report.segment;
    // This frame's motion in the camera's axes, and its error.
    Rigid motion;
    if (is_continued) motion = last_->world_camera.inverse() * world_camera;
    const Covariance error = motion_error(report, motion);
    if (!is_continued) error_ = {};
    error_ = sum(moved(error_, motion.inverse()), error);
    // Errors of the base, about the map's axes.
    Rigid map_axes;
    map_axes.rotation = map_base.rotation;
    odometry.pose.covariance = covariance_message(moved(moved(error_, base_camera), map_axes));
    if (is_continued) describe_velocity(base_camera, motion, error, map_header, odometry);
    add_transform(map_header, odometry.child_frame_id, map_base, outputs);
    // The camera drives in a map that never jumps; loops move that map as a whole.
    if (options_.mapper.keyframes > 0 && report.segment == 0) {
      Header closed_header = map_header;
      closed_header.frame_id = options_.closed_frame;
      const Rigid change =
          map_world_ * rigid_of(mapper_->closed_world()) * map_world_.inverse();
      add_transform(closed_header, options_.map_frame, change, outputs);
    }
  }

  static void add_transform(const Header &header, const std::string &child, const Rigid &rigid,
                            Outputs &outputs) {
    geometry_msgs::msg::TransformStamped transform;
    transform.header = header;
    transform.child_frame_id = child;
    transform.transform.translation.x = rigid.translation[0];
    transform.transform.translation.y = rigid.translation[1];
    transform.transform.translation.z = rigid.translation[2];
    transform.transform.rotation = pose_message(rigid).orientation;
    outputs.transforms.transforms.push_back(transform);
  }

  void describe_velocity(const Rigid &base_camera, const Rigid &motion, const Covariance &error,
                         const Header &header, nav_msgs::msg::Odometry &odometry) const {
    const int64_t now_ns = int64_t{header.stamp.sec} * 1000000000 + header.stamp.nanosec;
    const int64_t passed_ns = now_ns - static_cast<int64_t>(last_->time_ns);
    const double passed_s = 1e-9 * static_cast<double>(passed_ns);
    if (!(passed_s > 0)) return;
    const Rigid base_motion = base_camera * motion * base_camera.inverse();
    const auto q = quaternion_of(base_motion.rotation);
    const double sine = std::sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double per_s = (sine > 0 ? 2 * std::atan2(sine, q[0]) / sine : 2) / passed_s;
    auto &twist = odometry.twist.twist;
    twist.linear.x = base_motion.translation[0] / passed_s;
    twist.linear.y = base_motion.translation[1] / passed_s;
    twist.linear.z = base_motion.translation[2] / passed_s;
    twist.angular.x = q[1] * per_s;
    twist.angular.y = q[2] * per_s;
    twist.angular.z = q[3] * per_s;
    Covariance of_base = moved(error, base_camera);
    for (auto &row : of_base)
      for (double &entry : row) entry /= passed_s * passed_s;
    odometry.twist.covariance = covariance_message(of_base);
  }

  // The covariance of this frame's motion, in this camera's axes. A guess may be off by as much as
  // the camera moved, and by a little where it stood.
  static Covariance motion_error(const DynvoxReport &report, const Rigid &motion) {
    Covariance error{};
    if (report.pose_origin == DYNVOX_POSE_ORIGIN_EXTRAPOLATED) {
      const Vector &t = motion.translation;
      const double moved_m2 = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
      for (size_t axis = 0; axis < 3; ++axis) {
        error[axis][axis] = moved_m2 + 0.01;
        error[axis + 3][axis + 3] = 0.01;
      }
      return error;
    }
    // The library has rotation before translation, messages have it after.
    for (size_t row = 0; row < 6; ++row)
      for (size_t column = 0; column < 6; ++column)
        error[row][column] = report.motion_covariance[6 * ((row + 3) % 6) + (column + 3) % 6];
    return error;
  }

  static Covariance sum(Covariance a, const Covariance &b) {
    for (size_t at = 0; at < 36; ++at) a[at / 6][at % 6] += b[at / 6][at % 6];
    return a;
  }

  void describe_state(const Header &header, Outputs &outputs) const {
    using diagnostic_msgs::msg::DiagnosticStatus;
    const DynvoxReport &report = outputs.report;
    DiagnosticStatus status;
    status.name = "dynvox: mapping";
    status.hardware_id = header.frame_id;
    status.level = DiagnosticStatus::OK;
    status.message = "mapping";
    if (report.pose_origin == DYNVOX_POSE_ORIGIN_EXTRAPOLATED) {
      status.level = DiagnosticStatus::WARN;
      status.message = "the camera's pose is a guess: too little was matched";
    } else if (report.severity == DYNVOX_SEVERITY_MAP_AFFECTED) {
      status.level = DiagnosticStatus::WARN;
      status.message = "the map lacks a part: raise memory_mib";
    }
    char digest[17];
    std::snprintf(digest, sizeof digest, "%016" PRIx64, report.digest);
    const std::pair<const char *, std::string> values[] = {
        {"frame", std::to_string(report.frame)},
        {"digest", digest},
        {"pairs refused", std::to_string(pairs_refused_)},
        {"images without a partner", std::to_string(pairs_.unpaired())},
        {"pairs that waited in vain", std::to_string(incomplete_)},
        {"samples of the inertial unit", std::to_string(report.inertial.samples)},
        {"inertial unit trusted", report.inertial.trusted ? "yes" : "no"},
        {"pixels with disparity", std::to_string(report.disparities)},
        {"matches of the motion", std::to_string(report.inliers)},
        {"blocks in use", std::to_string(report.blocks)},
        {"blocks in all", std::to_string(report.blocks_capacity)},
        {"blocks lost", std::to_string(report.blocks_lost + report.blocks_refused)},
    };
    for (const auto &[key, value] : values) status.values.push_back(key_value(key, value));
    outputs.diagnostics.header = header;
    outputs.diagnostics.status.push_back(status);
  }

  struct Last {
    Rigid world_camera;
    uint64_t time_ns;
    uint16_t segment;
  };

  NodeOptions options_;
  Pairing<Image> pairs_;
  // Pairs whose samples or images have not come yet.
  std::deque<Pair> waiting_;
  InertialSamples samples_;
  LatestImages instances_, ignored_;
  std::optional<CameraInfo> left_info_, right_info_;
  StaticFrames frames_;
  std::optional<nav_msgs::msg::Odometry> pose_;
  std::unique_ptr<Mapper> mapper_;
  bool has_window_ = false;
  // The map's axes in terms of the mapper's world.
  Rigid map_world_;
  std::optional<Last> last_;
  // Error of the camera's pose, in its own axes.
  Covariance error_{};
  uint64_t pairs_mapped_ = 0, pairs_refused_ = 0, incomplete_ = 0;
};

}  // namespace dynvox_ros2
