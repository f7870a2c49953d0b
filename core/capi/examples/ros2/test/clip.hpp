// A packed fixture: `dynvox fixtures pack FIXTURE --out clip.bin`.
#pragma once

#include "dynvox.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

// Pixels of a pair; they lie in the clip's bytes.
struct ClipFrame {
  const uint8_t *left, *right;
};

struct Clip {
  std::vector<uint8_t> bytes;
  uint32_t width = 0, height = 0;
  DynvoxRig rig{};
  std::vector<ClipFrame> frames;
};

// Reads what fixtures/clip/src/lib.rs documents; masks are passed over.
inline Clip read_clip(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  Clip clip;
  clip.bytes.assign(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  size_t at = 8;
  const auto take = [&clip, &at](auto &value) {
    if (at + sizeof value > clip.bytes.size()) throw std::runtime_error("the clip ends early");
    std::memcpy(&value, clip.bytes.data() + at, sizeof value);
    at += sizeof value;
  };
  uint32_t kind = 1, frames = 0;
  if (clip.bytes.size() > 8 && std::memcmp(clip.bytes.data(), "DVXCLIP1", 8) == 0) take(kind);
  if (kind != 0) throw std::runtime_error(path + " is no clip of a mapper");
  take(clip.width);
  take(clip.height);
  take(frames);
  take(clip.rig.focal_px);
  take(clip.rig.center_u_px);
  take(clip.rig.center_v_px);
  take(clip.rig.baseline_m);
  const size_t pixels = size_t{clip.width} * clip.height;
  for (uint32_t frame = 0; frame < frames; ++frame) {
    if (at + 2 * pixels > clip.bytes.size()) throw std::runtime_error("the clip ends early");
    clip.frames.push_back({clip.bytes.data() + at, clip.bytes.data() + at + pixels});
    at += 2 * pixels;
    uint32_t masks = 0;
    take(masks);
    for (uint32_t mask = 0; mask < masks; ++mask) {
      uint32_t width = 0, height = 0;
      // Class, score, left and top come first.
      at += 1 + 4 + 4 + 4;
      take(width);
      take(height);
      at += size_t{width} * height;
    }
  }
  return clip;
}
