// As much of rclcpp as the node calls, within one process: it lets the node compile and run where
// no ROS is. A message goes from publish() into the queue of every subscription of its topic, which
// keeps the last ones as its quality of service says; spinning hands them to the callbacks.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace rclcpp {

// Quality of service: only the depth matters within a process.
class QoS {
 public:
  QoS(size_t depth) : depth_(depth) {}  // NOLINT: implicit in rclcpp, too.
  QoS &keep_last(size_t depth) {
    depth_ = depth;
    return *this;
  }
  QoS &reliable() { return *this; }
  QoS &transient_local() { return *this; }
  size_t depth() const { return depth_; }

 private:
  size_t depth_;
};

class SensorDataQoS : public QoS {
 public:
  SensorDataQoS() : QoS(5) {}
};

// Values of parameters, set before a node is made.
using ParameterValue =
    std::variant<bool, int64_t, double, std::string, std::vector<std::string>,
                 std::vector<int64_t>>;

struct NodeOptions {
  std::map<std::string, ParameterValue> overrides;
};

struct Logger {};
struct Clock {};

namespace stub {

// A queue of one subscription, or a timer that is due once.
struct Waiting {
  virtual ~Waiting() = default;
  // Handles one message; false if none waits.
  virtual bool handle() = 0;
};

struct Bus {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::weak_ptr<Waiting>> waiting;
  // Messages that queues had no room for.
  uint64_t lost = 0;
  std::map<std::string, std::vector<std::weak_ptr<void>>> topics;
};

inline Bus &bus() {
  static Bus bus;
  return bus;
}

template <typename Message>
struct Queue : Waiting {
  std::function<void(std::shared_ptr<const Message>)> callback;
  size_t depth = 0;
  std::deque<std::shared_ptr<const Message>> messages;

  bool handle() override {
    std::shared_ptr<const Message> message;
    {
      const std::lock_guard<std::mutex> lock(bus().mutex);
      if (messages.empty()) return false;
      message = messages.front();
      messages.pop_front();
    }
    callback(message);
    return true;
  }
};

template <typename Message>
void publish(const std::string &topic, std::shared_ptr<const Message> message) {
  const std::lock_guard<std::mutex> lock(bus().mutex);
  for (const auto &subscriber : bus().topics[topic]) {
    const auto queue = std::static_pointer_cast<Queue<Message>>(subscriber.lock());
    if (!queue) continue;
    queue->messages.push_back(message);
    if (queue->messages.size() > queue->depth) {
      queue->messages.pop_front();
      ++bus().lost;
    }
  }
  bus().changed.notify_all();
}

template <typename Message, typename Callback>
std::shared_ptr<Queue<Message>> subscribe(const std::string &topic, size_t depth, Callback with) {
  auto queue = std::make_shared<Queue<Message>>();
  queue->callback = std::move(with);
  queue->depth = depth;
  const std::lock_guard<std::mutex> lock(bus().mutex);
  bus().topics[topic].push_back(queue);
  bus().waiting.push_back(queue);
  return queue;
}

// Handles one message of every queue; false if none waited.
inline bool spin_once() {
  std::vector<std::weak_ptr<Waiting>> waiting;
  {
    const std::lock_guard<std::mutex> lock(bus().mutex);
    waiting = bus().waiting;
  }
  bool handled = false;
  for (const auto &one : waiting)
    if (const auto queue = one.lock()) handled |= queue->handle();
  return handled;
}

inline void spin_until(const std::function<bool()> &done) {
  while (!done()) {
    if (spin_once()) continue;
    std::unique_lock<std::mutex> lock(bus().mutex);
    bus().changed.wait_for(lock, std::chrono::milliseconds(5));
  }
}

}  // namespace stub

template <typename Message>
struct Subscription {
  using SharedPtr = std::shared_ptr<Subscription>;
  std::shared_ptr<stub::Queue<Message>> queue;
};

struct TimerBase : stub::Waiting {
  using SharedPtr = std::shared_ptr<TimerBase>;
  std::function<void()> callback;
  bool is_cancelled = false;
  void cancel() { is_cancelled = true; }
  bool handle() override {
    if (is_cancelled) return false;
    callback();
    return true;
  }
};

}  // namespace rclcpp

#define RCLCPP_INFO(logger, ...) \
  ((void)(logger), std::fprintf(stderr, __VA_ARGS__), std::fputc('\n', stderr))
#define RCLCPP_ERROR(logger, ...) RCLCPP_INFO(logger, __VA_ARGS__)
#define RCLCPP_ERROR_THROTTLE(logger, clock, period_ms, ...) \
  ((void)(clock), (void)(period_ms), RCLCPP_INFO(logger, __VA_ARGS__))
