// As much of rclcpp_lifecycle as the node calls: states are entered one after the other, publishers
// are silent unless the node is active.
#pragma once

#include "rclcpp/rclcpp.hpp"

namespace rclcpp_lifecycle {

class State {
 public:
  explicit State(std::string label) : label_(std::move(label)) {}
  std::string label() const { return label_; }

 private:
  std::string label_;
};

template <typename Message>
class LifecyclePublisher {
 public:
  using SharedPtr = std::shared_ptr<LifecyclePublisher>;
  LifecyclePublisher(std::string topic, std::shared_ptr<bool> is_active)
      : topic_(std::move(topic)), is_active_(std::move(is_active)) {}
  void publish(std::unique_ptr<Message> message) {
    if (*is_active_) rclcpp::stub::publish<Message>(topic_, std::move(message));
  }
  size_t get_subscription_count() const {
    const std::lock_guard<std::mutex> lock(rclcpp::stub::bus().mutex);
    return rclcpp::stub::bus().topics[topic_].size();
  }

 private:
  std::string topic_;
  std::shared_ptr<bool> is_active_;
};

namespace node_interfaces {
struct LifecycleNodeInterface {
  enum class CallbackReturn : uint8_t { SUCCESS, FAILURE, ERROR };
};
}  // namespace node_interfaces

class LifecycleNode : public node_interfaces::LifecycleNodeInterface {
 public:
  LifecycleNode(std::string name, const rclcpp::NodeOptions &options)
      : name_(std::move(name)), options_(options) {}
  virtual ~LifecycleNode() = default;

  virtual CallbackReturn on_configure(const State &) { return CallbackReturn::SUCCESS; }
  virtual CallbackReturn on_activate(const State &) {
    *is_active_ = true;
    return CallbackReturn::SUCCESS;
  }
  virtual CallbackReturn on_deactivate(const State &) {
    *is_active_ = false;
    return CallbackReturn::SUCCESS;
  }
  virtual CallbackReturn on_cleanup(const State &) { return CallbackReturn::SUCCESS; }

  const State &configure() { return enter(on_configure(state_), "inactive"); }
  const State &activate() { return enter(on_activate(state_), "active"); }
  const State &deactivate() { return enter(on_deactivate(state_), "inactive"); }
  const State &cleanup() { return enter(on_cleanup(state_), "unconfigured"); }
  const State &get_current_state() const { return state_; }

  template <typename Value>
  Value declare_parameter(const std::string &name, const Value &otherwise) {
    parameters_[name] = otherwise;
    const auto given = options_.overrides.find(name);
    if (given != options_.overrides.end()) parameters_[name] = given->second;
    return std::get<Value>(parameters_[name]);
  }

  template <typename Message>
  typename LifecyclePublisher<Message>::SharedPtr create_publisher(const std::string &topic,
                                                                   const rclcpp::QoS &) {
    return std::make_shared<LifecyclePublisher<Message>>(resolved(topic), is_active_);
  }

  template <typename Message, typename Callback>
  typename rclcpp::Subscription<Message>::SharedPtr create_subscription(const std::string &topic,
                                                                        const rclcpp::QoS &qos,
                                                                        Callback &&callback) {
    auto subscription = std::make_shared<rclcpp::Subscription<Message>>();
    subscription->queue =
        rclcpp::stub::subscribe<Message>(resolved(topic), qos.depth(), callback);
    return subscription;
  }

  template <typename Period, typename Callback>
  rclcpp::TimerBase::SharedPtr create_wall_timer(Period, Callback &&callback) {
    auto timer = std::make_shared<rclcpp::TimerBase>();
    timer->callback = callback;
    rclcpp::stub::bus().waiting.push_back(timer);
    return timer;
  }

  rclcpp::Logger get_logger() const { return {}; }
  std::shared_ptr<rclcpp::Clock> get_clock() const { return std::make_shared<rclcpp::Clock>(); }

 private:
  const State &enter(CallbackReturn result, const char *label) {
    if (result == CallbackReturn::SUCCESS) state_ = State(label);
    return state_;
  }

  std::string resolved(const std::string &topic) const {
    if (topic[0] == '~') return "/" + name_ + topic.substr(1);
    return topic[0] == '/' ? topic : "/" + topic;
  }

  std::string name_;
  rclcpp::NodeOptions options_;
  State state_{"unconfigured"};
  std::shared_ptr<bool> is_active_ = std::make_shared<bool>(false);
  std::map<std::string, rclcpp::ParameterValue> parameters_;
};

}  // namespace rclcpp_lifecycle
