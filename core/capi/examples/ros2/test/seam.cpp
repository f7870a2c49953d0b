// The node's logic without ROS: pairs, frames of reference, images, grids, errors.
#include "dynvox_ros2/node.hpp"

#include <cmath>
#include <cstdio>
#include <limits>

namespace {

using namespace dynvox_ros2;

constexpr uint32_t WIDTH = 320, HEIGHT = 96;
constexpr double FOCAL_PX = 200, BASELINE_M = 0.5;
constexpr double CENTER_U_PX = 159.5, CENTER_V_PX = 47.5;

int failures = 0;

void require(bool holds, const char *what) {
  if (holds) return;
  std::fprintf(stderr, "not so: %s\n", what);
  ++failures;
}

bool near(double a, double b, double by = 1e-9) { return std::fabs(a - b) <= by; }

template <typename Call>
std::string refusal(Call call) {
  try {
    call();
  } catch (const std::exception &error) {
    return error.what();
  }
  return "";
}

bool refuses(const std::string &sentence, const char *part) {
  return sentence.find(part) != std::string::npos;
}

template <typename Message>
void set_stamp(Message &message, int64_t ns) {
  message.header.stamp.sec = static_cast<int32_t>(ns / 1000000000);
  message.header.stamp.nanosec = static_cast<uint32_t>(ns % 1000000000);
}

Image::ConstSharedPtr stamped(int64_t ns) {
  auto image = std::make_shared<Image>();
  set_stamp(*image, ns);
  return image;
}

CameraInfo info_of(bool is_left) {
  CameraInfo info;
  info.width = WIDTH;
  info.height = HEIGHT;
  info.k = {FOCAL_PX, 0, CENTER_U_PX, 0, FOCAL_PX, CENTER_V_PX, 0, 0, 1};
  info.r = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  info.p = {FOCAL_PX, 0, CENTER_U_PX, is_left ? 0 : -FOCAL_PX * BASELINE_M, 0, FOCAL_PX,
            CENTER_V_PX, 0, 0, 0, 1, 0};
  return info;
}

// A textured wall; its left half is `left_px` of disparity away, its right half `right_px`.
Image::ConstSharedPtr wall(int64_t ns, bool is_left, uint32_t left_px, uint32_t right_px) {
  auto image = std::make_shared<Image>();
  set_stamp(*image, ns);
  image->header.frame_id = is_left ? "left_optical" : "right_optical";
  image->width = WIDTH;
  image->height = HEIGHT;
  image->encoding = "mono8";
  image->step = WIDTH;
  image->data.resize(size_t{WIDTH} * HEIGHT);
  for (uint32_t v = 0; v < HEIGHT; ++v)
    for (uint32_t u = 0; u < WIDTH; ++u) {
      // The column of the left image that this pixel shows.
      uint32_t shown = u;
      if (!is_left) shown = u + (u + right_px < WIDTH / 2 ? left_px : right_px);
      const uint32_t noise = (shown / 3 * 2654435761u) ^ (v / 3 * 40503777u);
      image->data[size_t{v} * WIDTH + u] = static_cast<uint8_t>(noise >> 7);
    }
  return image;
}

NodeOptions small() {
  NodeOptions options;
  options.mapper.bytes = size_t{16} << 20;
  options.mapper.window = {100, 100, 20};
  options.mapper.settings = {{"volume.voxel_size_m", "0.1"}};
  return options;
}

Node ready(NodeOptions options) {
  Node node(std::move(options));
  node.left_info(info_of(true));
  node.right_info(info_of(false));
  return node;
}

// Shows a wall for some frames; returns what the last one gives.
Outputs look(Node &node, uint32_t left_px, uint32_t right_px, int64_t from_ns = 1000000000) {
  std::optional<Outputs> outputs;
  for (int64_t frame = 0; frame < 4; ++frame) {
    const int64_t ns = from_ns + frame * 100000000;
    node.left(wall(ns, true, left_px, right_px));
    outputs = node.right(wall(ns, false, left_px, right_px));
  }
  if (!outputs) throw std::runtime_error("a pair gave nothing");
  return std::move(*outputs);
}

void images_find_their_partners() {
  Pairing<Image> pairs(5000000, 10);
  require(!pairs.left(stamped(0)) && pairs.right(stamped(1000000)), "a pair 1 ms apart");
  require(!pairs.left(stamped(100000000)) && !pairs.left(stamped(200000000)), "right ones late");
  const auto pair = pairs.right(stamped(200000000));
  require(pair && time_ns(*pair->first) == 200000000, "the lost right image is passed over");
  require(pairs.unpaired() == 1, "the image without a partner is counted");
  for (int64_t ns = 300; ns < 312; ++ns) pairs.right(stamped(ns * 1000000));
  require(pairs.unpaired() == 3, "a queue keeps ten");
}

void frames_are_chained_and_errors_follow() {
  StaticFrames frames;
  tf2_msgs::msg::TFMessage message;
  message.transforms.resize(2);
  message.transforms[0].header.frame_id = "base_link";
  message.transforms[0].child_frame_id = "mast";
  message.transforms[0].transform.translation.z = 1.2;
  message.transforms[1].header.frame_id = "mast";
  message.transforms[1].child_frame_id = "camera";
  message.transforms[1].transform.translation.x = 0.3;
  // A turn of 90 degrees to the left.
  message.transforms[1].transform.rotation.w = message.transforms[1].transform.rotation.z =
      std::sqrt(0.5);
  frames.add(message);
  const auto base_camera = frames.find("base_link", "camera");
  require(base_camera.has_value(), "a chain of two links");
  const Vector ahead = *base_camera * Vector{1, 0, 0};
  require(near(ahead[0], 0.3) && near(ahead[1], 1) && near(ahead[2], 1.2), "a point through it");
  require(!frames.find("odom", "camera"), "no chain");
  for (const double angle : {0.0, 0.3, 2.0, 3.1}) {
    const Matrix turn = rotation_of({std::cos(angle / 2), 0, std::sin(angle / 2), 0});
    const auto q = quaternion_of(turn);
    require(near(q[0], std::cos(angle / 2)) && near(q[2], std::sin(angle / 2)), "a quaternion");
  }
  // A radian of yaw moves the end of a lever of 10 m by 10 m sideways.
  Covariance yaw{};
  yaw[5][5] = 1.0;
  Rigid lever;
  lever.translation = {10, 0, 0};
  const Covariance at_end = moved(yaw, lever);
  require(near(at_end[1][1], 100) && near(at_end[0][0], 0) && near(at_end[5][5], 1), "a lever");
  // The origin lies behind the point that turns: to the left there is to the right here.
  require(near(at_end[1][5], -10) && near(at_end[5][1], -10), "the sign of a lever");
}

void lenses_come_from_camera_info() {
  CameraInfo left = info_of(true), right = info_of(false);
  left.distortion_model = right.distortion_model = "plumb_bob";
  left.d = {0.1, 0.2, 0.3, 0.4, 0.5};
  // The right camera is turned by 0.1 rad about its vertical axis.
  const double c = std::cos(0.1), s = std::sin(0.1);
  right.r = {c, 0, s, 0, 1, 0, -s, 0, c};
  const DynvoxRawRig rig = raw_rig_of(left, right);
  const double *lens = rig.left.parameters;
  require(lens[0] == 0.1 && lens[1] == 0.2 && lens[2] == 0.5, "radial parameters");
  require(lens[6] == 0.3 && lens[7] == 0.4, "tangential parameters");
  require(near(rig.t_right_left_m[0], -BASELINE_M * c), "the baseline in the turned camera");
  require(near(rig.t_right_left_m[2], -BASELINE_M * s), "its part along the axis");
  require(near(rig.r_right_left[2], -s) && near(rig.r_right_left[6], s), "the turn between them");
  left.distortion_model = "thin_prism";
  require(refuses(refusal([&] { raw_rig_of(left, right); }), "thin_prism"), "an unknown lens");
  const auto exchanged = refusal([] { rig_of(info_of(false).p, info_of(true).p); });
  require(refuses(exchanged, "rectified pair"), "exchanged cameras");
}

void images_come_in_many_encodings() {
  Image image;
  image.width = 2;
  image.height = 1;
  image.encoding = "bgra8";
  image.step = 8;
  image.data = {0, 0, 200, 255, 100, 0, 0, 255};
  const Picture picture(image);
  require(picture.grey.pixels[0] == (77 * 200 + 128) >> 8, "red of bgra8");
  require(picture.grey.pixels[1] == (29 * 100 + 128) >> 8, "blue of bgra8");
  image.encoding = "mono16";
  image.step = 4;
  image.data = {1, 20, 2, 30};
  require(Picture(image).grey.pixels[1] == 30, "the upper byte of mono16");
  image.data.resize(3);
  require(refuses(refusal([&] { Picture{image}; }), "shorter"), "an image that ends early");
  image.encoding = "bayer_rggb8";
  require(refuses(refusal([&] { Picture{image}; }), "bayer_rggb8"), "a Bayer pattern");

  Image depth;
  depth.width = 4;
  depth.height = 1;
  depth.encoding = "32FC1";
  depth.step = 16;
  const float metres[] = {10.0f, 0.0f, std::numeric_limits<float>::quiet_NaN(), 0.1f};
  depth.data.resize(16);
  std::memcpy(depth.data.data(), metres, 16);
  const auto disparity = disparity_of(depth, {FOCAL_PX, 0, 0, BASELINE_M});
  require(disparity[0] == 2560 && disparity[1] == 0 && disparity[2] == 0, "10 m are 10 px");
  require(disparity[3] == 0, "what is too near is unknown");
}

void a_grid_has_left_on_the_left_and_ahead_ahead() {
  Node node = ready(small());
  // 4 m away on the left, 8 m on the right.
  const Outputs outputs = look(node, 25, 12);
  require(outputs.grid && outputs.objects && outputs.grid->header.frame_id == "map", "a grid");
  const auto &grid = *outputs.grid;
  const auto at = [&grid](double x, double y) {
    const double cell_m = grid.info.resolution;
    const auto column = static_cast<size_t>((x - grid.info.origin.position.x) / cell_m);
    const auto row = static_cast<size_t>((y - grid.info.origin.position.y) / cell_m);
    return grid.data[row * grid.info.width + column];
  };
  const auto any = [&at](double from, double to, double y, int8_t state) {
    for (double x = from; x < to; x += 0.1)
      if (at(x, y) == state) return true;
    return false;
  };
  require(any(3.6, 4.6, 1.0, 100), "a wall at 4 m on the left");
  require(!any(3.6, 5.5, -1.5, 100), "none there on the right");
  require(any(7.0, 9.0, -1.5, 100), "a wall at 8 m on the right");
  require(at(3.0, 1.0) != 100 && at(-3.0, 1.0) == -1, "nothing is known behind");
}

void a_base_below_the_camera_is_moved_in_the_map() {
  NodeOptions options = small();
  options.base_frame = "base_link";
  Node node = ready(options);
  require(refuses(refusal([&] { look(node, 12, 12); }), "static transform"), "no transform yet");
  require(node.pairs_refused() > 0, "refused pairs are counted");
  tf2_msgs::msg::TFMessage message;
  message.transforms.resize(1);
  message.transforms[0].header.frame_id = "base_link";
  message.transforms[0].child_frame_id = "left_optical";
  message.transforms[0].transform.translation.z = 1.5;
  // From the camera's axes (right, down, ahead) to the base's (ahead, left, up).
  auto &q = message.transforms[0].transform.rotation;
  q.w = 0.5, q.x = -0.5, q.y = 0.5, q.z = -0.5;
  node.static_frames(message);
  const Outputs outputs = look(node, 12, 12, 9000000000);
  const auto &pose = outputs.odometry.pose.pose;
  require(outputs.odometry.child_frame_id == "base_link", "the base is what moves");
  require(near(pose.position.z, -1.5, 0.05) && near(pose.position.x, 0, 0.05), "below the camera");
  require(near(std::fabs(pose.orientation.w), 1, 1e-3), "level, and ahead is ahead");
  require(outputs.transforms.transforms[0].child_frame_id == "base_link", "so says /tf");
  const double sigma_m = std::sqrt(outputs.odometry.pose.covariance[0]);
  require(sigma_m > 1e-6 && sigma_m < 0.5, "with an error that is known");
}

void a_lost_camera_leaves_nothing_free() {
  Node node = ready(small());
  const Outputs before = look(node, 12, 12);
  require(before.diagnostics.status[0].level == 0, "all is well");
  auto black = std::make_shared<Image>(*wall(5000000000, true, 12, 12));
  black->data.assign(black->data.size(), 0);
  node.left(black);
  const auto lost = node.right(black);
  require(lost && lost->report.pose_origin == DYNVOX_POSE_ORIGIN_EXTRAPOLATED, "a guess");
  for (const int8_t cell : lost->grid->data) require(cell == -1, "all is unknown");
  require(lost->diagnostics.status[0].level == 1, "a warning says so");
  require(lost->odometry.pose.covariance[0] > 0.01, "and the covariance");
}

void another_estimator_may_give_poses() {
  Node node = ready(small());
  look(node, 12, 12);
  nav_msgs::msg::Odometry odometry;
  odometry.pose.pose = pose_message(map_of_world([] {
    DynvoxWindow window{};
    window.axes_world[0][0] = window.axes_world[1][2] = 1;
    window.axes_world[2][1] = -1;
    return window;
  }()));
  odometry.pose.pose.position.x = 0.25;
  node.pose(odometry);
  const Outputs outputs = look(node, 12, 12, 9000000000);
  require(outputs.report.pose_origin == DYNVOX_POSE_ORIGIN_GIVEN, "the pose is taken");
  require(near(outputs.odometry.pose.pose.position.x, 0.25, 1e-6), "and told again");
}

void depth_and_poses_of_others_are_mapped() {
  NodeOptions options = small();
  options.depth = true;
  Node node(options);
  node.left_info(info_of(true));
  auto depth = std::make_shared<Image>(*wall(1000000000, true, 1, 1));
  depth->encoding = "16UC1";
  depth->step = 2 * WIDTH;
  depth->data.resize(size_t{2} * WIDTH * HEIGHT);
  // A wall of 5,000 mm.
  for (size_t at = 0; at < depth->data.size(); at += 2)
    depth->data[at] = 5000 & 255, depth->data[at + 1] = 5000 >> 8;
  node.left(wall(1000000000, true, 1, 1));
  require(refuses(refusal([&] { node.right(depth); }), "needs poses"), "depth without poses");
  nav_msgs::msg::Odometry odometry;
  odometry.pose.pose = pose_message({{{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}}}, {}});
  node.pose(odometry);
  std::optional<Outputs> outputs;
  for (int64_t frame = 0; frame < 5; ++frame) {
    set_stamp(*depth, 2000000000 + frame * 100000000);
    node.left(wall(2000000000 + frame * 100000000, true, 1, 1));
    outputs = node.right(std::make_shared<Image>(*depth));
  }
  size_t occupied = 0;
  for (const int8_t cell : outputs->grid->data) occupied += cell == 100;
  require(occupied > 10, "the wall is in the grid");
}

void what_cannot_be_used_is_refused_in_a_sentence() {
  Node early(small());
  early.left(wall(0, true, 12, 12));
  require(!early.right(wall(0, false, 12, 12)) && early.pairs_refused() == 1, "no camera_info");
  NodeOptions options = small();
  options.mapper.settings = {{"volume.voxel_sise_m", "1"}};
  Node misspelt = ready(options);
  require(refuses(refusal([&] { look(misspelt, 12, 12); }), "voxel_sise_m"), "an unknown setting");
  options = small();
  options.mapper.settings = {{"volume.voxel_size_m", "-1"}};
  Node absurd = ready(options);
  require(refuses(refusal([&] { look(absurd, 12, 12); }), "cannot be used"), "out of range");
  options = small();
  options.mapper.bytes = 1 << 20;
  Node poor = ready(options);
  require(refuses(refusal([&] { look(poor, 12, 12); }), "at least"), "too few bytes");
}

Imu at_rest(int64_t ns) {
  Imu sample;
  set_stamp(sample, ns);
  sample.header.frame_id = "unit";
  // Samples that repeat would be a stuck unit.
  sample.angular_velocity.x = 1e-14 * static_cast<double>(ns % 7000000000);
  // The unit's z axis points up.
  sample.linear_acceleration.z = 9.81;
  return sample;
}

// Where the camera and the unit are on the robot: the camera looks along the robot's x axis.
tf2_msgs::msg::TFMessage mounting() {
  tf2_msgs::msg::TFMessage message;
  message.transforms.resize(2);
  message.transforms[0].header.frame_id = message.transforms[1].header.frame_id = "base_link";
  message.transforms[0].child_frame_id = "left_optical";
  message.transforms[0].transform.rotation =
      quaternion_message({{{0, 0, 1}, {-1, 0, 0}, {0, -1, 0}}});
  message.transforms[1].child_frame_id = "unit";
  message.transforms[1].transform.translation.x = -0.1;
  return message;
}

void a_pair_waits_for_its_samples() {
  NodeOptions options = small();
  options.imu = true;
  Node node = ready(options);
  std::optional<Outputs> outputs;
  for (int64_t frame = 0; frame < 24; ++frame) {
    const int64_t ns = 1000000000 + frame * 100000000;
    for (int64_t at = ns - 90000000; at < ns; at += 10000000)
      require(!node.imu(at_rest(at)), "nothing waits");
    node.left(wall(ns, true, 12, 12));
    require(!node.right(wall(ns, false, 12, 12)), "the sample of its time is missing");
    if (frame == 0) {
      const auto lost = [&] { node.imu(at_rest(ns)); };
      require(refuses(refusal(lost), "no static transforms lead"), "nobody said where it is");
      node.static_frames(mounting());
      continue;
    }
    outputs = node.imu(at_rest(ns + 1000000));
    require(outputs.has_value(), "the last sample completes the pair");
  }
  const DynvoxInertialReport &said = outputs->report.inertial;
  require(said.samples == 9 || said.samples == 10, "the samples of one frame");
  require(said.up_world[1] < -0.99, "which way is up");
  require(node.incomplete() == 0, "all came in time");
  // The unit falls silent: as many pairs wait as images do, then the oldest goes on without.
  for (int64_t frame = 0; frame <= 10; ++frame) {
    const int64_t ns = 5000000000 + frame * 100000000;
    node.left(wall(ns, true, 12, 12));
    outputs = node.right(wall(ns, false, 12, 12));
    require(outputs.has_value() == (frame == 10), "ten wait");
  }
  require(node.incomplete() == 1, "and it is counted");
}

// Numbers of instances: one of class 1, a car, and pixels that are nothing.
std::shared_ptr<Image> marks(int64_t ns, uint16_t number) {
  auto image = std::make_shared<Image>();
  set_stamp(*image, ns);
  image->width = WIDTH;
  image->height = HEIGHT;
  image->encoding = "16UC1";
  image->step = 2 * WIDTH;
  image->data.resize(size_t{2} * WIDTH * HEIGHT);
  for (size_t v = 20; v < 60; ++v)
    for (size_t u = 100; u < 180; ++u) {
      image->data[v * image->step + 2 * u] = static_cast<uint8_t>(number & 255);
      image->data[v * image->step + 2 * u + 1] = static_cast<uint8_t>(number >> 8);
    }
  return image;
}

void instances_become_tracks_and_ignored_pixels_nothing() {
  const auto image = marks(0, 1007);
  const Instances seen(*image);
  require(seen.detections().size() == 1, "one instance");
  const DynvoxDetection &car = seen.detections()[0];
  require(car.class_code == 1 && car.left == 100 && car.top == 20, "a car and its box");
  require(car.width == 80 && car.height == 40 && car.mask[79] == 1, "as large as it is");

  NodeOptions options = small();
  options.instances = options.ignored = true;
  Node node = ready(options), blind = ready(small());
  std::optional<Outputs> outputs;
  for (int64_t frame = 0; frame < 4; ++frame) {
    const int64_t ns = 1000000000 + frame * 100000000;
    node.left(wall(ns, true, 12, 12));
    require(!node.right(wall(ns, false, 12, 12)), "marks are missing");
    require(!node.instances(marks(ns, 1007)), "the ignored pixels are missing");
    outputs = node.ignored(marks(ns, frame < 3 ? 0 : 0x0101));
    require(outputs.has_value(), "all is there");
    blind.left(wall(ns, true, 12, 12));
    const auto without = blind.right(wall(ns, false, 12, 12));
    require(without->report.digest != outputs->report.digest, "the car is a track");
    const uint32_t lacking = without->report.disparities - outputs->report.disparities;
    require(frame < 3 ? lacking == 0 : lacking > 2000, "ignored pixels have no depth");
  }
  auto small_marks = marks(2000000000, 1007);
  small_marks->height = 60;
  node.left(wall(2000000000, true, 12, 12));
  node.right(wall(2000000000, false, 12, 12));
  node.ignored(marks(2000000000, 0));
  require(refuses(refusal([&] { node.instances(small_marks); }), "size of the left image"),
          "marks of another size");
}

void a_mesh_stands_in_the_map() {
  NodeOptions options = small();
  options.mesh_every = 1;
  options.mesh_triangles = 1000;
  Node node = ready(options);
  const Outputs outputs = look(node, 12, 12);
  require(outputs.mesh && outputs.mesh->points.size() == 3000, "as many triangles as asked for");
  const auto &q = outputs.mesh->pose.orientation;
  const Matrix turn = rotation_of({q.w, q.x, q.y, q.z});
  double nearest = 1e9, farthest = 0;
  for (const auto &point : outputs.mesh->points) {
    const double ahead = (turn * Vector{point.x, point.y, point.z})[0];
    nearest = std::min(nearest, ahead);
    farthest = std::max(farthest, ahead);
  }
  // 200 px times 0.5 m over 12 px.
  require(nearest > 7.5 && farthest < 9.2, "the wall is 8.3 m ahead");
}

void points_are_where_the_wall_is() {
  NodeOptions options = small();
  options.points_every = 1;
  Node node = ready(options);
  const Outputs outputs = look(node, 10, 10);
  const auto &cloud = *outputs.points;
  size_t at_wall = 0;
  for (size_t point = 0; point < cloud.width; ++point) {
    float z;
    std::memcpy(&z, cloud.data.data() + 16 * point + 8, 4);
    // 200 px x 0.5 m / 10 px.
    at_wall += z > 9.5f && z < 10.5f;
  }
  require(cloud.width > 500 && at_wall * 10 > cloud.width * 9, "the wall is 10 m away");
  require(cloud.data.size() == size_t{16} * cloud.width, "16 bytes a point");
}

void loops_move_the_map_as_a_whole() {
  NodeOptions options = small();
  Node without = ready(options);
  require(look(without, 12, 12).transforms.transforms.size() == 1, "the camera alone");
  options.mapper.keyframes = 20;
  Node node = ready(options);
  const auto transforms = look(node, 12, 12).transforms.transforms;
  require(transforms.size() == 2, "the camera and the map");
  require(transforms[0].header.frame_id == "map" &&
              transforms[1].header.frame_id == "closed_map" &&
              transforms[1].child_frame_id == "map",
          "from the closed map to the one as driven");
  const auto &change = transforms[1].transform;
  require(near(change.translation.x, 0) && near(std::fabs(change.rotation.w), 1),
          "both are one before the first loop");
}

}  // namespace

int main() {
  images_find_their_partners();
  frames_are_chained_and_errors_follow();
  lenses_come_from_camera_info();
  images_come_in_many_encodings();
  a_grid_has_left_on_the_left_and_ahead_ahead();
  a_base_below_the_camera_is_moved_in_the_map();
  a_lost_camera_leaves_nothing_free();
  another_estimator_may_give_poses();
  depth_and_poses_of_others_are_mapped();
  what_cannot_be_used_is_refused_in_a_sentence();
  points_are_where_the_wall_is();
  a_pair_waits_for_its_samples();
  instances_become_tracks_and_ignored_pixels_nothing();
  a_mesh_stands_in_the_map();
  loops_move_the_map_as_a_whole();
  return failures;
}
