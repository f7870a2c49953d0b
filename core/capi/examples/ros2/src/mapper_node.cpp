// Connects dynvox_ros2::Node to topics: a managed node, and a component that images reach without a
// copy. README.md lists topics and parameters.
#include "dynvox_ros2/node.hpp"

#include <rclcpp/rclcpp.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <rclcpp_lifecycle/lifecycle_node.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace dynvox_ros2 {

class MapperNode : public rclcpp_lifecycle::LifecycleNode {
 public:
  explicit MapperNode(const rclcpp::NodeOptions &options)
      : LifecycleNode("dynvox_mapper", options) {
    declare_all();
    if (!declare_parameter<bool>("autostart", true)) return;
    // As soon as the node spins; a lifecycle manager does it otherwise.
    start_ = create_wall_timer(std::chrono::milliseconds(0), [this] {
      start_->cancel();
      configure();
      activate();
    });
  }

  CallbackReturn on_configure(const rclcpp_lifecycle::State &) override {
    node_ = std::make_unique<Node>(options_);
    const rclcpp::QoS latest = rclcpp::QoS(1).transient_local();
    odometry_ = create_publisher<nav_msgs::msg::Odometry>("~/odometry", rclcpp::QoS(10));
    transforms_ = create_publisher<tf2_msgs::msg::TFMessage>("/tf", rclcpp::QoS(100));
    grid_ = create_publisher<nav_msgs::msg::OccupancyGrid>("~/grid", latest);
    objects_ =
        create_publisher<vision_msgs::msg::Detection3DArray>("~/objects", rclcpp::QoS(10));
    points_ = create_publisher<sensor_msgs::msg::PointCloud2>("~/points", rclcpp::QoS(1));
    mesh_ = create_publisher<visualization_msgs::msg::Marker>("~/mesh", latest);
    diagnostics_ =
        create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", rclcpp::QoS(10));
    return CallbackReturn::SUCCESS;
  }

  CallbackReturn on_activate(const rclcpp_lifecycle::State &state) override {
    LifecycleNode::on_activate(state);
    rclcpp::QoS images = rclcpp::SensorDataQoS();
    images.keep_last(queue_);
    if (reliable_) images.reliable();
    const std::string name = options_.rectified ? "/image_rect" : "/image_raw";
    left_ = create_subscription<Image>(
        "left" + name, images,
        [this](Image::ConstSharedPtr image) { take(&Node::left, std::move(image)); });
    right_ = create_subscription<Image>(
        options_.depth ? "left/depth" : "right" + name, images,
        [this](Image::ConstSharedPtr image) { take(&Node::right, std::move(image)); });
    if (options_.imu)
      imu_ = create_subscription<Imu>("imu", rclcpp::SensorDataQoS().keep_last(1024),
                                      [this](Imu::ConstSharedPtr sample) {
                                        take([&] { return node_->imu(*sample); });
                                      });
    if (options_.instances)
      instances_ = create_subscription<Image>(
          "left/instances", images,
          [this](Image::ConstSharedPtr image) { take(&Node::instances, std::move(image)); });
    if (options_.ignored)
      ignored_ = create_subscription<Image>(
          "left/ignored", images,
          [this](Image::ConstSharedPtr image) { take(&Node::ignored, std::move(image)); });
    left_info_ = create_subscription<CameraInfo>(
        "left/camera_info", images,
        [this](CameraInfo::ConstSharedPtr info) { node_->left_info(*info); });
    right_info_ = create_subscription<CameraInfo>(
        "right/camera_info", images,
        [this](CameraInfo::ConstSharedPtr info) { node_->right_info(*info); });
    static_frames_ = create_subscription<tf2_msgs::msg::TFMessage>(
        "/tf_static", rclcpp::QoS(100).transient_local(),
        [this](tf2_msgs::msg::TFMessage::ConstSharedPtr frames) { node_->static_frames(*frames); });
    if (given_pose_ || options_.depth)
      pose_ = create_subscription<nav_msgs::msg::Odometry>(
          "pose", rclcpp::QoS(50),
          [this](nav_msgs::msg::Odometry::ConstSharedPtr pose) { node_->pose(*pose); });
    return CallbackReturn::SUCCESS;
  }

  CallbackReturn on_deactivate(const rclcpp_lifecycle::State &state) override {
    left_.reset();
    right_.reset();
    left_info_.reset();
    right_info_.reset();
    static_frames_.reset();
    pose_.reset();
    imu_.reset();
    instances_.reset();
    ignored_.reset();
    return LifecycleNode::on_deactivate(state);
  }

  // Forgets the map and frees its memory.
  CallbackReturn on_cleanup(const rclcpp_lifecycle::State &) override {
    node_.reset();
    return CallbackReturn::SUCCESS;
  }

 private:
  void declare_all() {
    options_.map_frame = declare_parameter<std::string>("map_frame", options_.map_frame);
    options_.closed_frame = declare_parameter<std::string>("closed_frame", options_.closed_frame);
    options_.mapper.keyframes = whole("keyframes", 0);
    options_.base_frame = declare_parameter<std::string>("base_frame", options_.base_frame);
    options_.rectified = declare_parameter<bool>("rectified", options_.rectified);
    options_.depth = declare_parameter<bool>("depth", options_.depth);
    options_.depth_baseline_m =
        declare_parameter<double>("depth_baseline_m", options_.depth_baseline_m);
    options_.imu = declare_parameter<bool>("imu", options_.imu);
    options_.instances = declare_parameter<bool>("instances", options_.instances);
    options_.ignored = declare_parameter<bool>("ignored", options_.ignored);
    options_.mesh_every = static_cast<uint32_t>(whole("mesh_every", options_.mesh_every));
    options_.mesh_triangles = whole("mesh_triangles", options_.mesh_triangles);
    options_.slack_s = declare_parameter<double>("slack_s", options_.slack_s);
    options_.mapper.bytes = whole("memory_mib", 256) << 20;
    using Texts = std::vector<std::string>;
    using Numbers = std::vector<int64_t>;
    options_.mapper.settings = parsed(declare_parameter<Texts>("settings", Texts{}));
    const auto window = declare_parameter<Numbers>("window", Numbers{100, 100, 20});
    if (window.size() != 3 || window[0] < 0 || window[1] < 0 || window[2] < 0)
      throw std::runtime_error("window is three numbers of cells: right, ahead, up");
    for (size_t axis = 0; axis < 3; ++axis)
      options_.mapper.window[axis] = static_cast<size_t>(window[axis]);
    options_.points_every = static_cast<uint32_t>(whole("points_every", options_.points_every));
    options_.points_stride = whole("points_stride", 2);
    options_.grid_every = static_cast<uint32_t>(whole("grid_every", options_.grid_every));
    queue_ = options_.queue = whole("queue", 10);
    reliable_ = declare_parameter<bool>("reliable", false);
    given_pose_ = declare_parameter<bool>("given_pose", false);
  }

  // A parameter that is a number from 0 on.
  size_t whole(const std::string &name, size_t otherwise) {
    const auto value = declare_parameter<int64_t>(name, static_cast<int64_t>(otherwise));
    if (value < 0) throw std::runtime_error(name + " is negative: give 0 or more");
    return static_cast<size_t>(value);
  }

  static std::vector<std::pair<std::string, std::string>> parsed(
      const std::vector<std::string> &settings) {
    std::vector<std::pair<std::string, std::string>> pairs;
    for (const std::string &setting : settings) {
      const size_t at = setting.find('=');
      if (at == std::string::npos)
        throw std::runtime_error("the setting " + setting + " has no value: write key=value");
      pairs.emplace_back(setting.substr(0, at), setting.substr(at + 1));
    }
    return pairs;
  }

  // Takes an image, and publishes what the pair gives that it completes.
  void take(std::optional<Outputs> (Node::*side)(Image::ConstSharedPtr),
            Image::ConstSharedPtr image) {
    take([&] { return (node_.get()->*side)(std::move(image)); });
  }

  template <typename Taking>
  void take(Taking taking) {
    try {
      if (auto outputs = taking()) publish(*outputs);
    } catch (const std::exception &error) {
      RCLCPP_ERROR_THROTTLE(get_logger(), *get_clock(), 5000, "%s", error.what());
    }
  }

  void publish(Outputs &outputs) {
    send(*odometry_, outputs.odometry);
    send(*transforms_, outputs.transforms);
    send(*diagnostics_, outputs.diagnostics);
    if (outputs.grid) send(*grid_, *outputs.grid);
    if (outputs.objects) send(*objects_, *outputs.objects);
    if (outputs.points) send(*points_, *outputs.points);
    if (outputs.mesh) send(*mesh_, *outputs.mesh);
  }

  // Hands a message over, so that a subscriber in the same process gets it without a copy.
  template <typename To, typename Message>
  static void send(To &publisher, Message &message) {
    publisher.publish(std::make_unique<Message>(std::move(message)));
  }

  template <typename Message>
  using Publisher = typename rclcpp_lifecycle::LifecyclePublisher<Message>::SharedPtr;
  template <typename Message>
  using Subscription = typename rclcpp::Subscription<Message>::SharedPtr;

  NodeOptions options_;
  size_t queue_ = 10;
  bool reliable_ = false, given_pose_ = false;
  std::unique_ptr<Node> node_;
  rclcpp::TimerBase::SharedPtr start_;
  Publisher<nav_msgs::msg::Odometry> odometry_;
  Publisher<tf2_msgs::msg::TFMessage> transforms_;
  Publisher<nav_msgs::msg::OccupancyGrid> grid_;
  Publisher<vision_msgs::msg::Detection3DArray> objects_;
  Publisher<sensor_msgs::msg::PointCloud2> points_;
  Publisher<visualization_msgs::msg::Marker> mesh_;
  Publisher<diagnostic_msgs::msg::DiagnosticArray> diagnostics_;
  Subscription<Image> left_, right_, instances_, ignored_;
  Subscription<Imu> imu_;
  Subscription<CameraInfo> left_info_, right_info_;
  Subscription<tf2_msgs::msg::TFMessage> static_frames_;
  Subscription<nav_msgs::msg::Odometry> pose_;
};

}  // namespace dynvox_ros2

RCLCPP_COMPONENTS_REGISTER_NODE(dynvox_ros2::MapperNode)
