// Sums over the samples of a pixel whose bits do not depend on how the samples are divided into
// parts.
//
// Samples are summed one after the other in blocks of 16, and blocks in a binary tree: two nodes
// with a common parent are added as soon as both are known. So every range of blocks has a unique
// list of nodes, and merging the lists of adjacent ranges gives the list of their union.
#pragma once

#include <utility>
#include <vector>

#include "kernels/host_device.h"

namespace polymorph {

inline constexpr int kSampleBlock = 16;  ///< samples that are summed one after the other

/// A node of the tree: the blocks [first, first + count), where `count` is a power of two that
/// divides `first`.
struct BlockSpan {
  int first = 0, count = 1;
  PM_HD int end() const { return first + count; }
};

/// Tests whether two nodes are the children of one node.
PM_HD inline bool are_siblings(BlockSpan left, BlockSpan right) {
  return left.count == right.count && left.end() == right.first &&
         left.first % (2 * left.count) == 0;
}

/// Sums over a range of samples. `Sum` has add(const Sum&).
template <class Sum>
class SampleSums {
 public:
  struct Node {
    BlockSpan blocks;
    Sum sum;
  };

  /// The sum of the current block, to which samples are added.
  Sum& block() { return block_; }
  /// Adds the current block as the node of block `index`, and begins an empty one.
  void end_block(int index) { add({{index, 1}, std::exchange(block_, Sum{})}); }
  /// Adds a node. Nodes must come in ascending order; only a draft, a picture of the parts that
  /// there are (merge_parts()), may have gaps.
  void add(Node node) {
    // Merge the node with its sibling, their parent with its own sibling, and so on.
    while (has_last_ && are_siblings(last_.blocks, node.blocks)) {
      last_.sum.add(node.sum);
      last_.blocks.count *= 2;
      node = std::move(last_);
      has_last_ = !earlier_.empty();
      if (!has_last_) break;
      last_ = std::move(earlier_.back());
      earlier_.pop_back();
    }
    if (has_last_) earlier_.push_back(std::move(last_));
    last_ = std::move(node);
    has_last_ = true;
  }
  /// Lists the nodes in ascending order.
  std::vector<Node> nodes() const {
    std::vector<Node> nodes = earlier_;
    if (has_last_) nodes.push_back(last_);
    return nodes;
  }
  /// Returns the sum over all ended blocks, or an empty sum without any.
  Sum total() const {
    if (!has_last_ || earlier_.empty()) return last_.sum;
    Sum sum = earlier_.front().sum;
    for (std::size_t i = 1; i < earlier_.size(); ++i) sum.add(earlier_[i].sum);
    sum.add(last_.sum);
    return sum;
  }

 private:
  Sum block_{};
  // The last node is stored apart, because most pixels have only one node and then need no memory
  // for `earlier_`.
  std::vector<Node> earlier_;
  Node last_{};
  bool has_last_ = false;
};

}  // namespace polymorph
