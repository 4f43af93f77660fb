// Balls that do not change: an engine knows them again without comparing them.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <memory>
#include <utility>
#include <vector>

#include "types.h"

namespace polymorph {

/// A handle on balls; copies share them. An engine that was given a set, or made it, keeps its
/// balls where it works until it is given another, so call it with copies of one handle rather than
/// with vectors, each of which becomes a set of its own.
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

  /// Tests whether it is the same set, not only one of equal balls.
  bool is(const BallSet& other) const { return balls_ && balls_ == other.balls_; }

 private:
  std::shared_ptr<const std::vector<Ball>> balls_;
};

}  // namespace polymorph
