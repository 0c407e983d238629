// Face contact of two boxes: the part of one face that lies over the other, as at most four points.
//
// The incident face, the one that looks most against the normal, is clipped against the sides of
// the reference face by box_method.h, many pairs at a time; here is what goes in, and what comes
// out.
//
// Feature: where an incident corner, edge or face meets no, one or two sides of the reference face:
//   bits 12.. role and number of the reference face, 6..11 incident corner, edge or face,
//   0..5 set of the reference box's sides. Distinct within a manifold by construction, and the
//   same when another incident face that shares the corner or edge takes over.
#include "server/collision/box_faces.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "server/collision/tolerances.h"

namespace cradle {
namespace {

void set(BoxFaceBlock::Row* rows, int lane, double x, double y, double z) {
  rows[0][lane] = x;
  rows[1][lane] = y;
  rows[2][lane] = z;
}

/// The axis of a box that looks most along a direction of which it has these parts.
int most_upright(double up_x, double up_y, double up_z) {
  const double x = std::abs(up_x), y = std::abs(up_y), z = std::abs(up_z);
  return x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
}

// The edge of the incident face that a candidate is on, or its diagonal for the whole face.
constexpr std::array<std::uint8_t, kBoxCandidates> kFrom = {0, 0, 1, 1, 2, 2, 3, 3, 0, 0, 0, 0},
                                                   kTo = {1, 1, 2, 2, 3, 3, 0, 0, 2, 2, 2, 2};

int after(int axis) { return axis < 2 ? axis + 1 : 0; }
int before(int axis) { return axis > 0 ? axis - 1 : 2; }

}  // namespace

void BoxFaces::begin(const FacingBoxes& boxes, int axis, double margin, double slack,
                     BoxFaceBlock& block, int lane) {
  x_ = after(axis);
  y_ = before(axis);
  z_ = axis;
  turn_ = boxes.t[axis] >= 0 ? 1 : -1;
  height_ = boxes.h_reference[axis];
  slack_ = slack;
  const std::uint32_t right = 2u << 2 * x_, left = 1u << 2 * x_, front = 2u << 2 * y_,
                      back = 1u << 2 * y_;
  side_bits_ = {0,           right,       left, front, back, right | front, left | front,
                left | back, right | back};
  const Matrix& C = boxes.C;
  const Vector& h = boxes.h_incident;
  const int incident = most_upright(C(z_, 0), C(z_, 1), C(z_, 2));
  const int e = after(incident), f = before(incident);
  const double up = C(z_, incident);
  const bool upper = turn_ * up < 0;
  const double out = upper ? h[incident] : -h[incident];
  set(block.middle, lane, boxes.t[x_] + C(x_, incident) * out, boxes.t[y_] + C(y_, incident) * out,
      turn_ * (boxes.t[z_] + up * out) - height_);
  set(block.e, lane, C(x_, e) * h[e], C(y_, e) * h[e], turn_ * C(z_, e) * h[e]);
  set(block.f, lane, C(x_, f) * h[f], C(y_, f) * h[f], turn_ * C(z_, f) * h[f]);
  block.half_x[lane] = boxes.h_reference[x_];
  block.half_y[lane] = boxes.h_reference[y_];
  block.length_e[lane] = h[e];
  block.length_f[lane] = h[f];
  block.slope2[lane] = 1 / (up * up) - 1;
  block.slack[lane] = slack;
  block.margin[lane] = margin;
  for (std::size_t k = 0; k < kSides; ++k) {
    corner_bits_[k] = static_cast<std::uint32_t>(upper) << incident |
                      static_cast<std::uint32_t>(kSignX[k] > 0) << e |
                      static_cast<std::uint32_t>(kSignY[k] > 0) << f;
  }
}

/// Without branches: what meets where is chance.
std::uint32_t BoxFaces::feature(const BoxFaceBlock& block, int lane, std::size_t candidate) const {
  const auto side =
      static_cast<std::size_t>(static_cast<int>(block.side[candidate][lane] - kNoSide));
  const std::uint32_t from = corner_bits_[kFrom[candidate]];
  const std::uint32_t to = side == 0 ? from : corner_bits_[kTo[candidate]];
  return name_of(from & to, from | to) << 6 | side_bits_[side];
}

void BoxFaces::set_manifold(const BoxFaceBlock& block, int lane, const Pose& X_WR,
                            std::uint32_t role, Manifold& manifold) const {
  const Matrix& R = X_WR.R;
  const Vector x_W = R.col(x_), y_W = R.col(y_), z_W = turn_ * R.col(z_);
  const Vector origin_W = X_WR.x + z_W * height_;
  const auto number = static_cast<std::uint32_t>(2 * z_ + (turn_ > 0 ? 1 : 0));
  const std::uint32_t face_name = (6 * role + number) << 12;
  manifold.normal_W = role == 0 ? z_W : Vector(-z_W);
  manifold.count = 0;
  auto set = static_cast<std::uint32_t>(static_cast<int>(block.set[lane]));
  for (; set != 0; set &= set - 1) {
    const auto c = static_cast<std::size_t>(std::countr_zero(set));
    const double z = block.z[c][lane];
    manifold.points[static_cast<std::size_t>(manifold.count++)] = {
        origin_W + x_W * block.x[c][lane] + y_W * block.y[c][lane] + z_W * (0.5 * z), z,
        face_name | feature(block, lane, c)};
  }
  manifold.lead =
      std::min(block.inside[lane] + slack_, kTolerances.kept_slide_m / block.steepness[lane]);
}

}  // namespace cradle
