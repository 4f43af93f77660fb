// Shared, immutable set of balls, which an engine recognises without comparing balls.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include "types.h"

namespace polymorph {

/// Handle of a set of balls; copies share the set. An engine keeps one set in its own memory: the
/// last one that it was given or made. So pass copies of one handle rather than vectors, each of
/// which becomes a new set.
class BallSet {
 public:
  BallSet() = default;
  BallSet(std::vector<Ball> balls)  // NOLINT(google-explicit-constructor): a vector is a new set
      : balls_(std::make_shared<const std::vector<Ball>>(std::move(balls))) {}
  BallSet(std::initializer_list<Ball> balls) : BallSet(std::vector<Ball>(balls)) {}

  const std::vector<Ball>& balls() const {
    static const std::vector<Ball> none;
    return balls_ ? *balls_ : none;
  }
  std::size_t size() const { return balls().size(); }
  bool empty() const { return balls().empty(); }
  const Ball& operator[](std::size_t i) const { return balls()[i]; }
  auto begin() const { return balls().begin(); }
  auto end() const { return balls().end(); }

  /// Tests whether both handles share one set; sets with equal balls are different ones.
  bool is(const BallSet& other) const { return balls_ && balls_ == other.balls_; }

 private:
  std::shared_ptr<const std::vector<Ball>> balls_;
};

}  // namespace polymorph
