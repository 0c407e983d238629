#include "tests/bench/fcl_oracle.h"

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/collision_object.h>
#include <fcl/narrowphase/continuous_collision.h>
#include <fcl/narrowphase/distance.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <concepts>
#include <csignal>
#include <memory>
#include <system_error>

#include "server/stopwatch.h"

namespace cradle::bench {
namespace {

using Geometry = std::unique_ptr<fcl::CollisionGeometryd>;

Geometry geometry_of(const TriangleMesh& mesh) {
  auto model = std::make_unique<fcl::BVHModel<fcl::OBBRSSd>>();
  model->beginModel();
  for (const Triangle& t : mesh.triangles) {
    const auto corner = [&](std::size_t k) -> const Vector& {
      return mesh.vertices[static_cast<std::size_t>(t[k])];
    };
    model->addTriangle(corner(0), corner(1), corner(2));
  }
  model->endModel();
  return model;
}

Geometry geometry_of(const Solid& solid) {
  const Shape& shape = solid.shape;
  const double r = shape.radius_m(), length = 2 * shape.half_length_m();
  const Vector half = to_eigen(shape.half_extents_m());
  switch (shape.kind) {
    case ShapeKind::sphere:
      return std::make_unique<fcl::Sphered>(r);
    case ShapeKind::box:
      return std::make_unique<fcl::Boxd>(2 * half);
    case ShapeKind::half_space:
      return std::make_unique<fcl::Halfspaced>(Vector::UnitZ(), 0);
    case ShapeKind::capsule:
      return std::make_unique<fcl::Capsuled>(r, length);
    case ShapeKind::cylinder:
      return std::make_unique<fcl::Cylinderd>(r, length);
    case ShapeKind::cone:
      return std::make_unique<fcl::Coned>(r, length);
    case ShapeKind::ellipsoid:
      return std::make_unique<fcl::Ellipsoidd>(half);
    case ShapeKind::hull: {
      const ConvexHull& hull = solid.hull();
      auto faces = std::make_shared<std::vector<int>>();
      for (std::size_t f = 0; f < hull.face_count(); ++f) {
        const auto loop = hull.face(f);
        faces->push_back(static_cast<int>(loop.size()));
        faces->insert(faces->end(), loop.begin(), loop.end());
      }
      return std::make_unique<fcl::Convexd>(std::make_shared<std::vector<Vector>>(hull.vertices),
                                            static_cast<int>(hull.face_count()), faces);
    }
    case ShapeKind::mesh:
      return geometry_of(std::get<TriangleMesh>(solid.geometry->value));
    default:
      return nullptr;
  }
}

fcl::Transform3d transform_of(const Pose& X) {
  fcl::Transform3d T = fcl::Transform3d::Identity();
  T.linear() = X.R;
  T.translation() = X.x;
  return T;
}

struct Question {
  Geometry A, B;
  fcl::Transform3d X_WA, X_WB;

  explicit Question(const Pair& pair)
      : A(geometry_of(pair.A)),
        B(geometry_of(pair.B)),
        X_WA(transform_of(pair.X_WA)),
        X_WB(transform_of(pair.X_WB)) {}
};

fcl::GJKSolverType solver_of(const FclWay& way) {
  return way.by_other_solver ? fcl::GST_INDEP : fcl::GST_LIBCCD;
}

FclAnswer contacts(const Question& q, const FclWay& way) {
  fcl::CollisionRequestd request(8, true);
  request.gjk_solver_type = solver_of(way);
  request.gjk_tolerance = way.tolerance;
  fcl::CollisionResultd result;
  fcl::collide(q.A.get(), q.X_WA, q.B.get(), q.X_WB, request, result);
  FclAnswer answer;
  answer.points = static_cast<int>(result.numContacts());
  for (std::size_t k = 0; k < result.numContacts(); ++k) {
    const fcl::Contactd& contact = result.getContact(k);
    if (k > 0 && -contact.penetration_depth >= answer.separation) continue;
    answer.separation = -contact.penetration_depth;
    answer.is_exchanged = contact.o1 != q.A.get();
    answer.n = answer.is_exchanged ? fcl::Vector3d(-contact.normal) : contact.normal;
    answer.p_W = contact.pos;
  }
  return answer;
}

FclAnswer distance(const Question& q, bool is_signed, const FclWay& way) {
  fcl::DistanceRequestd request(true, is_signed);
  request.gjk_solver_type = solver_of(way);
  request.distance_tolerance = way.tolerance;
  fcl::DistanceResultd result;
  FclAnswer answer;
  answer.points = 1;
  answer.separation = fcl::distance(q.A.get(), q.X_WA, q.B.get(), q.X_WB, request, result);
  const Vector between = result.nearest_points[1] - result.nearest_points[0];
  const double length = between.norm();
  if (length > 0) answer.n = between * ((answer.separation < 0 ? -1 : 1) / length);
  return answer;
}

FclAnswer answer_to(const Question& q, FclQuestion question, const FclWay& way = {}) {
  FclAnswer answer;
  try {
    answer = question == FclQuestion::contacts
                 ? contacts(q, way)
                 : distance(q, question == FclQuestion::signed_distance, way);
    answer.end = FclEnd::End::answered;
  } catch (const std::exception&) {
    answer.end = FclEnd::End::threw;
  }
  return answer;
}

FclImpact impact(const Question& q, const Vector& travel, FclSearch search, FclMotion motion) {
  fcl::ContinuousCollisionRequestd request;
  request.ccd_motion_type = motion == FclMotion::screw ? fcl::CCDM_SCREW : fcl::CCDM_TRANS;
  request.ccd_solver_type =
      search == FclSearch::samples ? fcl::CCDC_NAIVE : fcl::CCDC_CONSERVATIVE_ADVANCEMENT;
  fcl::ContinuousCollisionResultd result;
  fcl::Transform3d end = q.X_WB;
  end.translation() += travel;
  FclImpact found;
  try {
    fcl::continuousCollide(q.B.get(), q.X_WB, end, q.A.get(), q.X_WA, q.X_WA, request, result);
    found.end = FclEnd::End::answered;
    found.is_hit = result.is_collide;
    found.time = result.time_of_contact;
  } catch (const std::exception&) {
    found.end = FclEnd::End::threw;
  }
  return found;
}

/// Memory that a child shares with us.
template <class Item>
class Shared {
 public:
  explicit Shared(std::size_t count) : bytes_(std::max<std::size_t>(1, count) * sizeof(Item)) {
    memory_ = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory_ == MAP_FAILED) throw std::system_error(errno, std::generic_category(), "mmap");
  }
  ~Shared() { munmap(memory_, bytes_); }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;
  Item* get() const { return static_cast<Item*>(memory_); }

 private:
  std::size_t bytes_;
  void* memory_;
};

/// Does the work in a child whose last words nobody hears. 0, or what the child died of: a signal,
/// or -1.
template <class Work>
int died_in_child(Work work) {
  const pid_t child = fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    for (const int end : {SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS}) signal(end, SIG_DFL);
    if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) dup2(nowhere, 2);
    work();
    _exit(0);
  }
  int status = -1;
  if (waitpid(child, &status, 0) != child) return -1;
  return WIFSIGNALED(status) ? WTERMSIG(status) : -(status != 0);
}

/// `ask(k)` for each of `count`, where an answer is plain bytes; one of which a child dies stays
/// as it is made.
template <class Answer, class Ask>
std::vector<Answer> ask_all(std::size_t count, Ask ask) {
  const Shared<Answer> answers(count);
  const Shared<std::size_t> done(1);
  *done.get() = 0;
  while (*done.get() < count) {
    const int died_of = died_in_child([&] {
      for (std::size_t& k = *done.get(); k < count; ++k) {
        answers.get()[k] = Answer();
        answers.get()[k] = ask(k);
      }
    });
    if (died_of == 0) continue;
    if constexpr (std::derived_from<Answer, FclEnd>) answers.get()[*done.get()].signal = died_of;
    ++*done.get();  // past what it died of
  }
  return {answers.get(), answers.get() + count};
}

}  // namespace

bool can_ask_fcl(const Pair& pair, FclQuestion question) {
  return question == FclQuestion::contacts || !pair.has(ShapeKind::half_space);
}

std::vector<FclAnswer> ask_fcl(std::span<const Pair> pairs, FclQuestion question, FclWay way) {
  return ask_all<FclAnswer>(
      pairs.size(), [&](std::size_t k) { return answer_to(Question(pairs[k]), question, way); });
}

std::vector<Aabb> ask_fcl_boxes(std::span<const Pair> pairs) {
  return ask_all<Aabb>(pairs.size(), [&](std::size_t k) {
    const std::shared_ptr<fcl::CollisionGeometryd> A = geometry_of(pairs[k].A);
    const fcl::CollisionObjectd object(A, transform_of(pairs[k].X_WA));
    return Aabb{object.getAABB().min_, object.getAABB().max_};
  });
}

std::vector<FclImpact> ask_fcl_impacts(std::span<const Pair> pairs, const Vector& travel,
                                       FclSearch search, FclMotion motion) {
  return ask_all<FclImpact>(pairs.size(), [&](std::size_t k) {
    return impact(Question(pairs[k]), travel, search, motion);
  });
}

std::optional<double> time_fcl(std::span<const Pair> pairs, FclQuestion question) {
  constexpr int kRounds = 5;
  const Shared<double> ns(1);
  const int died_of = died_in_child([&] {
    std::vector<Question> questions;
    for (const Pair& pair : pairs) questions.emplace_back(pair);
    std::vector<double> us;
    for (int round = 0; round < kRounds; ++round) {
      const Stopwatch stopwatch;
      for (const Question& q : questions) answer_to(q, question);
      us.push_back(stopwatch.elapsed_us());
    }
    *ns.get() = 1e3 * summarise(us).median_us / static_cast<double>(pairs.size());
  });
  if (died_of != 0) return std::nullopt;
  return *ns.get();
}

}  // namespace cradle::bench
