/// Contacts sorted into blocks of eight for the wide kernels, and back.
#pragma once

#include <span>
#include <vector>

#include "server/dynamics/contact/body_lines.h"
#include "server/dynamics/contact/colouring.h"
#include "server/dynamics/contact/contact_block.h"
#include "server/dynamics/contact/contact_constraint.h"

namespace cradle {

/// A contact with rolling or torsional friction, and where its impulses are.
struct PlacedContact {
  ContactConstraint* c;
  ContactBlock* block;
  int lane;
};

class ContactBlocks {
 public:
  /// Those of `constraints` whose arms hold at the tick's start; the others are for one after
  /// another. `h`: the sub-step, s.
  void pack(std::span<ContactConstraint* const> constraints, const BodyLines& bodies, double h);
  /// Arms of contacts with kinematic bodies that spin: to where the contacts are by now.
  void follow_driven(const BodyLines& bodies);
  /// The warm start of contacts of struck bodies alone.
  void repeat_struck(const ContactKernels& kernels, BodyLines& bodies);
  /// Leaves of their impulses this part, by island.
  void scale_struck(const ContactKernels& kernels, std::span<const double> shares,
                    const BodyLines& bodies);
  /// The forces of the last sub-step, separations and effective masses.
  void unpack(double h) const;

  /// To be gone through in order, each block after the one before.
  std::span<const BlockRun> runs() const { return runs_; }
  /// Of those that are packed; until the next ones are.
  std::span<const PlacedContact> turning() const { return turning_; }

 private:
  /// A contact with a kinematic body.
  struct Driven {
    std::size_t block;
    int lane;
    bool is_A;      // or B
    Vector arm, n;  // m, at the tick's start
  };

  void count_groups(std::span<ContactConstraint* const> constraints, const BodyLines& bodies);
  void note_driven(std::size_t block, int lane, const ContactConstraint& c,
                   const BodyLines& bodies);
  void make_runs(std::int32_t nobody, std::int32_t waste);

  Colouring colouring_;
  std::vector<ColouredPair> pairs_;
  std::vector<ContactConstraint*> sources_;  // the constraints of `pairs_`
  std::vector<std::int32_t> groups_;  // and where they belong: by colour, then number of points
  std::vector<std::int32_t> counts_;  // of each group
  std::vector<ContactBlock> blocks_;  // the first `used_` of them
  std::size_t used_ = 0;
  std::vector<BlockRun> runs_;
  std::vector<PlacedContact> turning_;
  std::vector<Driven> driven_;
};

}  // namespace cradle
