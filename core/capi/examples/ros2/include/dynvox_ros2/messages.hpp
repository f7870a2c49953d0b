// What a frame gives, as messages of ROS 2.
#pragma once

#include "dynvox.h"
#include "dynvox_ros2/geometry.hpp"
#include "dynvox_ros2/mapper.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <diagnostic_msgs/msg/diagnostic_status.hpp>
#include <geometry_msgs/msg/pose.hpp>
#include <nav_msgs/msg/occupancy_grid.hpp>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <vision_msgs/msg/detection3_d_array.hpp>
#include <visualization_msgs/msg/marker.hpp>

namespace dynvox_ros2 {

using Header = std_msgs::msg::Header;

inline geometry_msgs::msg::Quaternion quaternion_message(const Matrix &rotation) {
  const auto q = quaternion_of(rotation);
  geometry_msgs::msg::Quaternion message;
  message.w = q[0];
  message.x = q[1];
  message.y = q[2];
  message.z = q[3];
  return message;
}

inline geometry_msgs::msg::Pose pose_message(const Rigid &rigid) {
  geometry_msgs::msg::Pose pose;
  pose.position.x = rigid.translation[0];
  pose.position.y = rigid.translation[1];
  pose.position.z = rigid.translation[2];
  pose.orientation = quaternion_message(rigid.rotation);
  return pose;
}

inline std::array<double, 36> covariance_message(const Covariance &covariance) {
  std::array<double, 36> rows{};
  for (size_t at = 0; at < 36; ++at) rows[at] = covariance[at / 6][at % 6];
  return rows;
}

// The axes of the window, right, ahead and up, are the map's -y, x and z.
inline Rigid map_of_world(const DynvoxWindow &window) {
  Rigid map_world;
  for (size_t axis = 0; axis < 3; ++axis) {
    map_world.rotation[0][axis] = window.axes_world[1][axis];
    map_world.rotation[1][axis] = -window.axes_world[0][axis];
    map_world.rotation[2][axis] = window.axes_world[2][axis];
  }
  return map_world;
}

// The window as a grid in the map: 0 free, 100 occupied, -1 unknown. All is unknown where the pose
// is a guess: nothing can be placed by it.
inline nav_msgs::msg::OccupancyGrid grid_message(const Header &header, const Window &window,
                                                 bool is_placed) {
  const size_t width = window.place.size[0], length = window.place.size[1];
  nav_msgs::msg::OccupancyGrid grid;
  grid.header = header;
  grid.info.map_load_time = header.stamp;
  grid.info.resolution = static_cast<float>(window.place.cell_m);
  // Cells run ahead (x) first, and rows from right to left (y).
  grid.info.width = static_cast<uint32_t>(length);
  grid.info.height = static_cast<uint32_t>(width);
  grid.info.origin.position.x = window.place.origin_m[1];
  grid.info.origin.position.y =
      -(window.place.origin_m[0] + static_cast<double>(width) * window.place.cell_m);
  grid.data.assign(width * length, -1);
  if (!is_placed) return grid;
  for (size_t left = 0; left < width; ++left)
    for (size_t ahead = 0; ahead < length; ++ahead) {
      const uint8_t state = window.state[ahead * width + (width - 1 - left)];
      grid.data[left * length + ahead] = state == 2 ? 100 : state == 1 ? 0 : -1;
    }
  return grid;
}

inline const char *class_name(uint8_t code) {
  static const char *const names[] = {"other", "car", "bus", "truck", "van", "train", "person",
                                      "rider", "bicycle", "motorcycle", "animal", "moving object"};
  return code < std::size(names) ? names[code] : names[0];
}

// The moving objects as boxes in the map.
inline vision_msgs::msg::Detection3DArray objects_message(
    const Header &header, const std::vector<DynvoxMovingBox> &boxes,
    const std::vector<DynvoxTrack> &tracks) {
  vision_msgs::msg::Detection3DArray objects;
  objects.header = header;
  for (const DynvoxMovingBox &box : boxes) {
    Rigid map_box;
    map_box.translation = {box.center_m[1], -box.center_m[0], box.center_m[2]};
    const double ahead = box.heading[1], left = -box.heading[0];
    map_box.rotation = {{{ahead, -left, 0}, {left, ahead, 0}, {0, 0, 1}}};
    vision_msgs::msg::Detection3D object;
    object.header = header;
    object.id = std::to_string(box.id);
    object.bbox.center = pose_message(map_box);
    object.bbox.size.x = 2 * box.half_m[0];
    object.bbox.size.y = 2 * box.half_m[1];
    object.bbox.size.z = 2 * box.half_m[2];
    vision_msgs::msg::ObjectHypothesisWithPose result;
    const auto track = std::find_if(tracks.begin(), tracks.end(),
                                    [&box](const DynvoxTrack &one) { return one.id == box.id; });
    if (track != tracks.end()) {
      result.hypothesis.class_id = class_name(track->class_code);
      result.hypothesis.score = track->score;
    }
    result.pose.pose = object.bbox.center;
    const double variance = static_cast<double>(box.sigma_m) * box.sigma_m;
    for (size_t axis = 0; axis < 3; ++axis) result.pose.covariance[7 * axis] = variance;
    object.results.push_back(result);
    objects.detections.push_back(object);
  }
  return objects;
}

// Points with colour, 16 bytes each: x, y, z, and rgb as rviz reads it.
inline sensor_msgs::msg::PointCloud2 points_message(const Header &header,
                                                    const std::vector<Point> &points) {
  using sensor_msgs::msg::PointField;
  sensor_msgs::msg::PointCloud2 cloud;
  cloud.header = header;
  cloud.height = 1;
  cloud.width = static_cast<uint32_t>(points.size());
  const char *const names[] = {"x", "y", "z", "rgb"};
  for (uint32_t at = 0; at < 4; ++at) {
    PointField field;
    field.name = names[at];
    field.offset = 4 * at;
    field.datatype = PointField::FLOAT32;
    field.count = 1;
    cloud.fields.push_back(field);
  }
  cloud.is_bigendian = false;
  cloud.point_step = 16;
  cloud.row_step = 16 * cloud.width;
  cloud.is_dense = true;
  cloud.data.resize(size_t{16} * points.size());
  uint8_t *to = cloud.data.data();
  for (const Point &point : points) {
    const float place[] = {point.x, point.y, point.z};
    std::memcpy(to, place, sizeof place);
    const uint8_t bgr[] = {point.colour[2], point.colour[1], point.colour[0], 0};
    std::memcpy(to + 12, bgr, sizeof bgr);
    to += 16;
  }
  return cloud;
}

// Triangles of the map with their colours; `map_world` maps the mapper's world to the map.
inline visualization_msgs::msg::Marker mesh_message(const Header &header,
                                                    const std::vector<DynvoxTriangle> &triangles,
                                                    const Rigid &map_world) {
  using visualization_msgs::msg::Marker;
  Marker mesh;
  mesh.header = header;
  mesh.ns = "dynvox";
  mesh.type = Marker::TRIANGLE_LIST;
  mesh.action = Marker::ADD;
  mesh.pose = pose_message(map_world);
  mesh.scale.x = mesh.scale.y = mesh.scale.z = 1.0;
  mesh.color.a = 1.0f;
  mesh.points.reserve(3 * triangles.size());
  mesh.colors.reserve(3 * triangles.size());
  for (const DynvoxTriangle &triangle : triangles)
    for (const DynvoxVertex &corner : triangle.vertices) {
      geometry_msgs::msg::Point point;
      point.x = corner.position_m[0];
      point.y = corner.position_m[1];
      point.z = corner.position_m[2];
      mesh.points.push_back(point);
      std_msgs::msg::ColorRGBA colour;
      colour.r = static_cast<float>(corner.colour[0]) / 255.0f;
      colour.g = static_cast<float>(corner.colour[1]) / 255.0f;
      colour.b = static_cast<float>(corner.colour[2]) / 255.0f;
      colour.a = 1.0f;
      mesh.colors.push_back(colour);
    }
  return mesh;
}

// A named number of a diagnostic message.
inline diagnostic_msgs::msg::KeyValue key_value(const std::string &key, const std::string &value) {
  diagnostic_msgs::msg::KeyValue pair;
  pair.key = key;
  pair.value = value;
  return pair;
}

}  // namespace dynvox_ros2
