// Maps a rectified stereo pair. README.md lists topics and parameters.
#include "dynvox_ros2/mapper.hpp"

#include <geometry_msgs/msg/transform_stamped.hpp>
#include <message_filters/subscriber.h>
#include <message_filters/sync_policies/approximate_time.h>
#include <message_filters/synchronizer.h>
#include <nav_msgs/msg/odometry.hpp>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/image_encodings.hpp>
#include <sensor_msgs/msg/camera_info.hpp>
#include <sensor_msgs/msg/image.hpp>
#include <sensor_msgs/msg/point_cloud2.hpp>
#include <sensor_msgs/point_cloud2_iterator.hpp>
#include <tf2_ros/transform_broadcaster.h>
#include <visualization_msgs/msg/marker_array.hpp>

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

using sensor_msgs::msg::CameraInfo;
using sensor_msgs::msg::Image;
namespace encodings = sensor_msgs::image_encodings;

namespace {

// The grey picture of a message, and its own colours where it is RGB. `computed` holds grey that had to be computed.
struct Picture {
  DynvoxImage grey{};
  DynvoxImage colour{};
  std::vector<uint8_t> computed;

  explicit Picture(const Image &image) {
    const bool rgb = image.encoding == encodings::RGB8, bgr = image.encoding == encodings::BGR8;
    const size_t channels = rgb || bgr ? 3 : 1;
    if (!(rgb || bgr || image.encoding == encodings::MONO8))
      throw std::runtime_error("images are " + image.encoding + ": give mono8, rgb8 or bgr8, as image_proc's rectified topics have them");
    if (image.step < channels * image.width || image.data.size() < size_t{image.step} * image.height)
      throw std::runtime_error("an image is shorter than it says");
    if (channels == 1) {
      grey = {image.data.data(), image.step};
      return;
    }
    computed = dynvox_ros2::grey_of(image.data.data(), image.width, image.height, image.step, bgr ? 2 : 0);
    grey = {computed.data(), image.width};
    if (rgb && image.step % 3 == 0) colour = {image.data.data(), image.step / 3};
  }
};

template <typename Quaternion>
void set_rotation(Quaternion &to, const DynvoxPose &pose) {
  to.w = pose.rotation[0];
  to.x = pose.rotation[1];
  to.y = pose.rotation[2];
  to.z = pose.rotation[3];
}

template <typename Vector>
void set_vector(Vector &to, const double *from) {
  to.x = from[0];
  to.y = from[1];
  to.z = from[2];
}

}  // namespace

class MapperNode : public rclcpp::Node {
 public:
  MapperNode() : Node("dynvox_mapper") {
    map_frame_ = declare_parameter<std::string>("map_frame", "map");
    memory_mib_ = declare_parameter<int64_t>("memory_mib", 256);
    settings_ = declare_parameter<std::vector<std::string>>("settings", std::vector<std::string>{});
    points_every_ = declare_parameter<int64_t>("points_every", 5);
    points_stride_ = declare_parameter<int64_t>("points_stride", 2);
    odometry_ = create_publisher<nav_msgs::msg::Odometry>("~/odometry", 10);
    points_ = create_publisher<sensor_msgs::msg::PointCloud2>("~/points", rclcpp::QoS(1));
    tracks_ = create_publisher<visualization_msgs::msg::MarkerArray>("~/tracks", 10);
    transforms_ = std::make_unique<tf2_ros::TransformBroadcaster>(*this);
    const auto qos = rclcpp::SensorDataQoS().get_rmw_qos_profile();
    left_.subscribe(this, "left/image_rect", qos);
    right_.subscribe(this, "right/image_rect", qos);
    left_info_.subscribe(this, "left/camera_info", qos);
    right_info_.subscribe(this, "right/camera_info", qos);
    pairs_ = std::make_unique<message_filters::Synchronizer<Policy>>(Policy(10), left_, right_, left_info_, right_info_);
    pairs_->registerCallback(&MapperNode::pair, this);
  }

 private:
  using Policy = message_filters::sync_policies::ApproximateTime<Image, Image, CameraInfo, CameraInfo>;

  void pair(const Image::ConstSharedPtr &left, const Image::ConstSharedPtr &right, const CameraInfo::ConstSharedPtr &left_info,
            const CameraInfo::ConstSharedPtr &right_info) {
    try {
      map(*left, *right, *left_info, *right_info);
    } catch (const std::exception &error) {
      RCLCPP_ERROR_THROTTLE(get_logger(), *get_clock(), 5000, "%s", error.what());
    }
  }

  void map(const Image &left, const Image &right, const CameraInfo &left_info, const CameraInfo &right_info) {
    if (left.width != right.width || left.height != right.height) throw std::runtime_error("the images of a pair differ in size");
    const Picture left_picture(left), right_picture(right);
    if (!mapper_) {
      rig_ = dynvox_ros2::rig_of(left_info.p, right_info.p);
      mapper_.emplace(rig_, left.width, left.height, static_cast<size_t>(memory_mib_) << 20, parsed_settings());
      RCLCPP_INFO(get_logger(), "mapping %u x %u px in %ld MiB, baseline %.3f m", left.width, left.height, static_cast<long>(memory_mib_), rig_.baseline_m);
    }
    const uint64_t time_ns = static_cast<uint64_t>(rclcpp::Time(left.header.stamp).nanoseconds());
    DynvoxFrame frame{};
    frame.width = left.width;
    frame.height = left.height;
    frame.left = left_picture.grey;
    frame.right = right_picture.grey;
    frame.colour = left_picture.colour;
    frame.time_ns = &time_ns;
    const DynvoxReport report = mapper_->step(frame);
    if (report.severity == DYNVOX_SEVERITY_MAP_AFFECTED)
      RCLCPP_WARN_THROTTLE(get_logger(), *get_clock(), 5000, "frame %u: the map is affected", report.frame);
    publish_pose(left.header, report.t_world_camera);
    publish_tracks(left.header);
    if (points_every_ > 0 && report.frame % points_every_ == 0 && points_->get_subscription_count() > 0)
      publish_points(left.header, report.t_world_camera);
  }

  std::vector<std::pair<std::string, std::string>> parsed_settings() const {
    std::vector<std::pair<std::string, std::string>> parsed;
    for (const std::string &setting : settings_) {
      const size_t at = setting.find('=');
      if (at == std::string::npos) throw std::runtime_error("the setting " + setting + " has no value: write key=value");
      parsed.emplace_back(setting.substr(0, at), setting.substr(at + 1));
    }
    return parsed;
  }

  void publish_pose(const std_msgs::msg::Header &header, const DynvoxPose &pose) {
    nav_msgs::msg::Odometry odometry;
    odometry.header.stamp = header.stamp;
    odometry.header.frame_id = map_frame_;
    odometry.child_frame_id = header.frame_id;
    set_vector(odometry.pose.pose.position, pose.translation_m);
    set_rotation(odometry.pose.pose.orientation, pose);
    odometry_->publish(odometry);
    geometry_msgs::msg::TransformStamped transform;
    transform.header = odometry.header;
    transform.child_frame_id = header.frame_id;
    set_vector(transform.transform.translation, pose.translation_m);
    set_rotation(transform.transform.rotation, pose);
    transforms_->sendTransform(transform);
  }

  // A ball at each moving object, red while it moves.
  void publish_tracks(const std_msgs::msg::Header &header) {
    visualization_msgs::msg::MarkerArray markers;
    for (const DynvoxTrack &track : mapper_->tracks()) {
      visualization_msgs::msg::Marker marker;
      marker.header.stamp = header.stamp;
      marker.header.frame_id = map_frame_;
      marker.ns = "tracks";
      marker.id = static_cast<int>(track.id);
      marker.type = visualization_msgs::msg::Marker::SPHERE;
      set_vector(marker.pose.position, track.center_world_m);
      marker.pose.orientation.w = 1.0;
      marker.scale.x = marker.scale.y = marker.scale.z = 1.0;
      const bool moves = track.state == DYNVOX_MOTION_STATE_DYNAMIC;
      marker.color.r = moves ? 0.9f : 0.3f;
      marker.color.g = 0.4f;
      marker.color.b = moves ? 0.2f : 0.8f;
      marker.color.a = 0.7f;
      marker.lifetime = rclcpp::Duration::from_seconds(0.5);
      markers.markers.push_back(marker);
    }
    tracks_->publish(markers);
  }

  void publish_points(const std_msgs::msg::Header &header, const DynvoxPose &pose) {
    const auto points = mapper_->seen(pose, rig_, static_cast<size_t>(points_stride_ > 0 ? points_stride_ : 1));
    sensor_msgs::msg::PointCloud2 cloud;
    cloud.header = header;
    sensor_msgs::PointCloud2Modifier fields(cloud);
    fields.setPointCloud2FieldsByString(2, "xyz", "rgb");
    fields.resize(points.size());
    sensor_msgs::PointCloud2Iterator<float> x(cloud, "x"), y(cloud, "y"), z(cloud, "z");
    sensor_msgs::PointCloud2Iterator<uint8_t> r(cloud, "r"), g(cloud, "g"), b(cloud, "b");
    for (const auto &point : points) {
      *x = point.x, *y = point.y, *z = point.z;
      *r = point.colour[0], *g = point.colour[1], *b = point.colour[2];
      ++x, ++y, ++z, ++r, ++g, ++b;
    }
    points_->publish(cloud);
  }

  std::string map_frame_;
  int64_t memory_mib_ = 0, points_every_ = 0, points_stride_ = 0;
  std::vector<std::string> settings_;
  DynvoxRig rig_{};
  std::optional<dynvox_ros2::Mapper> mapper_;
  rclcpp::Publisher<nav_msgs::msg::Odometry>::SharedPtr odometry_;
  rclcpp::Publisher<sensor_msgs::msg::PointCloud2>::SharedPtr points_;
  rclcpp::Publisher<visualization_msgs::msg::MarkerArray>::SharedPtr tracks_;
  std::unique_ptr<tf2_ros::TransformBroadcaster> transforms_;
  message_filters::Subscriber<Image> left_, right_;
  message_filters::Subscriber<CameraInfo> left_info_, right_info_;
  std::unique_ptr<message_filters::Synchronizer<Policy>> pairs_;
};

int main(int argc, char **argv) {
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<MapperNode>());
  rclcpp::shutdown();
  return 0;
}
