// Pairs the messages of two cameras by their times, and counts what found no partner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

namespace dynvox_ros2 {

// Time of a message, ns.
template <typename Message>
int64_t time_ns(const Message &message) {
  const auto &stamp = message.header.stamp;
  return int64_t{stamp.sec} * 1000000000 + int64_t{stamp.nanosec};
}

template <typename Message>
class Pairing {
 public:
  using Pointer = std::shared_ptr<const Message>;
  using Pair = std::pair<Pointer, Pointer>;

  // Times of a pair differ by at most `slack_ns`. Of each camera `depth` messages wait.
  Pairing(int64_t slack_ns, size_t depth) : slack_ns_(slack_ns), depth_(depth) {}

  // Takes a message of the left camera; returns the pair that it completes.
  std::optional<Pair> left(Pointer message) { return add(left_, std::move(message)); }

  // Takes a message of the right camera; returns the pair that it completes.
  std::optional<Pair> right(Pointer message) { return add(right_, std::move(message)); }

  // Messages that found no partner.
  uint64_t unpaired() const { return unpaired_; }

 private:
  using Queue = std::deque<Pointer>;

  std::optional<Pair> add(Queue &queue, Pointer message) {
    queue.push_back(std::move(message));
    while (!left_.empty() && !right_.empty()) {
      const int64_t apart_ns = time_ns(*left_.front()) - time_ns(*right_.front());
      if (apart_ns >= -slack_ns_ && apart_ns <= slack_ns_) {
        Pair pair{take(left_), take(right_)};
        return pair;
      }
      // Messages of a camera come in order: the earlier one's partner comes no more.
      drop(apart_ns < 0 ? left_ : right_);
    }
    if (queue.size() > depth_) drop(queue);
    return std::nullopt;
  }

  static Pointer take(Queue &queue) {
    Pointer first = std::move(queue.front());
    queue.pop_front();
    return first;
  }

  void drop(Queue &queue) {
    queue.pop_front();
    ++unpaired_;
  }

  int64_t slack_ns_;
  size_t depth_;
  Queue left_, right_;
  uint64_t unpaired_ = 0;
};

}  // namespace dynvox_ros2
