// Components are found by their class's name in ROS; here by this function.
#pragma once

#include "rclcpp_lifecycle/lifecycle_node.hpp"

std::shared_ptr<rclcpp_lifecycle::LifecycleNode> make_component(const rclcpp::NodeOptions &);

#define RCLCPP_COMPONENTS_REGISTER_NODE(Class)                                               \
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> make_component(                           \
      const rclcpp::NodeOptions &options) {                                                  \
    return std::make_shared<Class>(options);                                                 \
  }
