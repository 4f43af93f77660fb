// Sums over the samples of a pixel that are the same bits in whatever parts they are taken.
//
// Samples are summed one after the other in blocks of 16, and blocks in a binary tree: two
// neighbours whose union is a node of the tree are added as soon as both are there. So any range of
// blocks has one list of nodes, and adjacent ranges add up to those of their union.
#pragma once

#include <utility>
#include <vector>

namespace polymorph {

inline constexpr int kSampleBlock = 16;  ///< samples that are summed one after the other

/// A node of the tree: the blocks [first, first + count), where `count` is a power of two that
/// divides `first`.
struct BlockSpan {
  int first = 0, count = 1;
  int end() const { return first + count; }
};

/// Tests whether the two make up a node.
inline bool are_siblings(BlockSpan left, BlockSpan right) {
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

  /// The sum over the block that is under way.
  Sum& block() { return block_; }
  /// Ends the block with this index.
  void end_block(int index) { add({{index, 1}, std::exchange(block_, Sum{})}); }
  /// Adds a node. Nodes come in ascending order and without gaps.
  void add(Node node) {
    while (!nodes_.empty() && are_siblings(nodes_.back().blocks, node.blocks)) {
      Node left = std::move(nodes_.back());
      nodes_.pop_back();
      left.sum.add(node.sum);
      left.blocks.count *= 2;
      node = std::move(left);
    }
    nodes_.push_back(std::move(node));
  }
  const std::vector<Node>& nodes() const { return nodes_; }
  /// The sum over all ended blocks.
  Sum total() const {
    if (nodes_.empty()) return {};
    Sum sum = nodes_.front().sum;
    for (std::size_t i = 1; i < nodes_.size(); ++i) sum.add(nodes_[i].sum);
    return sum;
  }

 private:
  Sum block_{};
  std::vector<Node> nodes_;
};

}  // namespace polymorph
