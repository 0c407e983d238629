// Face contact of two boxes: the part of one face that lies over the other, as at most four points.
//
// The incident face, the one that looks most against the normal, is clipped against the sides of
// the reference face by box_method.h, many pairs at a time; here is what comes out.
//
// Feature: where an incident corner, edge or face meets no, one or two sides of the reference face:
//   bits 12.. role and number of the reference face, 6..11 incident corner, edge or face,
//   0..5 set of the reference box's sides. Distinct within a manifold by construction, and the
//   same when another incident face that shares the corner or edge takes over.
#include "server/collision/box_faces.h"

#include <bit>

namespace cradle {
namespace {

constexpr std::uint32_t kFaces = 6;

constexpr int after(int axis) {
  constexpr int kAfter[] = {1, 2, 0};
  return kAfter[axis];
}
constexpr int before(int axis) {
  constexpr int kBefore[] = {2, 0, 1};
  return kBefore[axis];
}

/// Bits 6..11, by the incident face and the candidate: of its corner, and of the edge that it is
/// on, or the whole face.
using IncidentNames = std::array<std::array<std::array<std::uint16_t, 2>, kBoxCandidates>, kFaces>;

constexpr IncidentNames list_incident_names() {
  IncidentNames names{};
  for (std::uint32_t face = 0; face < kFaces; ++face) {
    const int axis = static_cast<int>(face / 2);
    const auto corner = [&](std::size_t k) {
      return (face & 1u) << axis | (kSignX[k] > 0 ? 1u : 0u) << after(axis) |
             (kSignY[k] > 0 ? 1u : 0u) << before(axis);
    };
    for (std::size_t c = 0; c < kBoxCandidates; ++c) {
      const bool is_edge = c < 8;
      const std::uint32_t from = corner(is_edge ? c / 2 : 0),
                          to = corner(is_edge ? (c / 2 + 1) % 4 : 2);
      names[face][c] = {static_cast<std::uint16_t>(name_of(from, from) << 6),
                        static_cast<std::uint16_t>(name_of(from & to, from | to) << 6)};
    }
  }
  return names;
}

/// Bits 0..5, by the axis of the reference face and what meets there: none, x+, x-, y+, y-, and
/// corners.
using SideBits = std::array<std::array<std::uint16_t, 9>, 3>;

constexpr SideBits list_side_bits() {
  SideBits bits{};
  for (int axis = 0; axis < 3; ++axis) {
    const auto side = [](int of, unsigned which) {
      return static_cast<std::uint16_t>(which << 2 * of);
    };
    const std::uint16_t right = side(after(axis), 2), left = side(after(axis), 1),
                        front = side(before(axis), 2), back = side(before(axis), 1);
    const auto both = [](unsigned one, unsigned other) {
      return static_cast<std::uint16_t>(one | other);
    };
    bits[static_cast<std::size_t>(axis)] = {0,
                                            right,
                                            left,
                                            front,
                                            back,
                                            both(right, front),
                                            both(left, front),
                                            both(left, back),
                                            both(right, back)};
  }
  return bits;
}

constexpr IncidentNames kIncidentNames = list_incident_names();
constexpr SideBits kSideBits = list_side_bits();

/// As Manifold::choice.
std::uint64_t choice_of(const BoxFaceBlock& block, int lane) {
  const auto set = static_cast<std::uint64_t>(static_cast<int>(block.set[lane]));
  const auto faces = static_cast<std::uint64_t>(static_cast<int>(block.faces[lane]));
  return faces << kBoxCandidates | set;
}

}  // namespace

void set_manifold(const BoxFaceBlock& block, int lane, const Pose& X_WR,
                  const BoxFaceBlock::Row* separations, Manifold& manifold) {
  const auto number = static_cast<std::uint32_t>(static_cast<int>(block.reference[lane]));
  const auto incident = static_cast<std::size_t>(static_cast<int>(block.incident[lane]));
  const bool on_A = block.on_A[lane] > 0;
  const int z = static_cast<int>(number / 2), x = after(z), y = before(z);
  constexpr double kSign[] = {-1, 1};
  const double turn = kSign[number & 1];
  const BoxAxesBlock::Row* const halves[] = {block.h_B, block.h_A};
  const double height = halves[on_A ? 1 : 0][z][lane];
  const Vector x_W = X_WR.R.col(x), y_W = X_WR.R.col(y), z_W = turn * X_WR.R.col(z);
  const Vector origin_W = X_WR.x + z_W * height;
  const std::uint32_t face_name = ((on_A ? 0 : kFaces) + number) << 12;
  manifold.normal_W = kSign[on_A ? 1 : 0] * turn * X_WR.R.col(z);
  manifold.lead = block.bears[lane];
  manifold.choice = choice_of(block, lane);
  int count = 0;
  auto set = static_cast<std::uint32_t>(static_cast<int>(block.set[lane]));
  for (; set != 0; set &= set - 1) {
    const auto c = static_cast<std::size_t>(std::countr_zero(set));
    const auto side = static_cast<std::size_t>(static_cast<int>(block.side[c][lane]));
    const double height_of_middle = 0.5 * block.z[c][lane];
    manifold.points[static_cast<std::size_t>(count++)] = {
        origin_W + x_W * block.x[c][lane] + y_W * block.y[c][lane] + z_W * height_of_middle,
        separations[c][lane],
        face_name | kIncidentNames[incident][c][side != 0] |
            kSideBits[static_cast<std::size_t>(z)][side]};
  }
  manifold.count = count;
}

}  // namespace cradle
