// ODE as Debian builds it, in double, with its defaults: QuickStep with 20 iterations, its error
// reduction and softness. What its users must choose is as in its examples: the hash space, up to
// eight contacts a pair, friction as a pyramid that the normal force scales (dContactApprox1), and
// bounces above 0.1 m/s.
#include <ode/ode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <vector>

#include "tests/bench/peer.h"

namespace cradle::bench {
namespace {

constexpr int kContactsMax = 8;
constexpr double kBounce_mps = 0.1;

/// What a geometry points at, for as long as it lives.
struct MeshData {
  std::vector<double> vertices;
  std::vector<dTriIndex> triangles;
  dTriMeshDataID id = dGeomTriMeshDataCreate();

  MeshData() = default;
  MeshData(const MeshData&) = delete;
  MeshData& operator=(const MeshData&) = delete;
  ~MeshData() { dGeomTriMeshDataDestroy(id); }
};
struct HullData {
  std::vector<double> planes, points;
  std::vector<unsigned> faces;
};

class OdePeer final : public Peer {
 public:
  OdePeer(const WorldSettings& world, const PeerSettings& settings)
      : step_s_(1 / (world.rate_hz * settings.steps_a_tick)), steps_(settings.steps_a_tick) {
    dRandSetSeed(0);  // QuickStep shuffles its rows: every world from the same start
    const Vec3& g = world.gravity_W;
    dWorldSetGravity(world_, g.x, g.y, g.z);
    if (settings.iterations > 0) dWorldSetQuickStepNumIterations(world_, settings.iterations);
  }
  OdePeer(const OdePeer&) = delete;
  OdePeer& operator=(const OdePeer&) = delete;
  ~OdePeer() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
  }

  void add(const BodySpec& spec, const BodyMass& mass, const StoredGeometry* geometry) override {
    Placed& placed = bodies_.emplace_back();
    placed.spec = spec;
    placed.geom = geom_of(spec, geometry);
    const dQuaternion q{spec.q_WB.w, spec.q_WB.x, spec.q_WB.y, spec.q_WB.z};
    const Vec3 &x = spec.p_WBo, &v = spec.v_WBcm, &w = spec.w_WB;
    if (placed.geom != nullptr) dGeomSetData(placed.geom, &placed.spec.material);
    if (spec.kind == BodyKind::dynamic) {
      placed.body = dBodyCreate(world_);
      const Vector J = mass.J_kgm2.diagonal();
      dMass of;
      dMassSetParameters(&of, mass.mass_kg, 0, 0, 0, J.x(), J.y(), J.z(), 0, 0, 0);
      dBodySetMass(placed.body, &of);
      dBodySetPosition(placed.body, x.x, x.y, x.z);
      dBodySetQuaternion(placed.body, q);
      dBodySetLinearVel(placed.body, v.x, v.y, v.z);
      dBodySetAngularVel(placed.body, w.x, w.y, w.z);
      if (placed.geom != nullptr) dGeomSetBody(placed.geom, placed.body);
    } else if (placed.geom != nullptr && spec.shape.kind != ShapeKind::half_space) {
      dGeomSetPosition(placed.geom, x.x, x.y, x.z);
      dGeomSetQuaternion(placed.geom, q);
    }
  }

  void step() override {
    for (int i = 0; i < steps_; ++i) {
      dSpaceCollide(space_, this, [](void* self, dGeomID a, dGeomID b) {
        static_cast<OdePeer*>(self)->touch(a, b);
      });
      dWorldQuickStep(world_, step_s_);
      dJointGroupEmpty(contacts_);
    }
  }

  BodyState state(std::size_t number) const override {
    const Placed& placed = bodies_[number];
    BodyState state;
    if (placed.body == nullptr) {
      state.p_WBo = placed.spec.p_WBo;
      state.q_WB = placed.spec.q_WB;
      return state;
    }
    const auto three = [](const dReal* v) { return Vec3{v[0], v[1], v[2]}; };
    const dReal* q = dBodyGetQuaternion(placed.body);
    state.p_WBo = three(dBodyGetPosition(placed.body));
    state.q_WB = {q[0], q[1], q[2], q[3]};
    state.v_WBcm = three(dBodyGetLinearVel(placed.body));
    state.w_WB = three(dBodyGetAngularVel(placed.body));
    return state;
  }

 private:
  /// From the first world to the end of the last.
  struct Library {
    Library() { dInitODE2(0); }
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;
    ~Library() { dCloseODE(); }
  };
  struct Placed {
    BodySpec spec;
    dGeomID geom = nullptr;
    dBodyID body = nullptr;  // null: static
  };

  void touch(dGeomID a, dGeomID b) {
    const dBodyID A = dGeomGetBody(a), B = dGeomGetBody(b);
    if (A == nullptr && B == nullptr) return;
    std::array<dContact, kContactsMax> contacts;
    const int count = dCollide(a, b, kContactsMax, &contacts[0].geom, sizeof(dContact));
    const auto &m = *static_cast<const Material*>(dGeomGetData(a)),
               &n = *static_cast<const Material*>(dGeomGetData(b));
    for (int i = 0; i < count; ++i) {
      dContact& contact = contacts[static_cast<std::size_t>(i)];
      dSurfaceParameters& surface = contact.surface;
      surface = {};
      surface.mode = dContactApprox1 | dContactBounce;
      surface.mu = std::sqrt(m.friction * n.friction);
      surface.bounce = std::max(m.restitution, n.restitution);
      surface.bounce_vel = kBounce_mps;
      dJointAttach(dJointCreateContact(world_, contacts_, &contact), A, B);
    }
  }

  dGeomID geom_of(const BodySpec& spec, const StoredGeometry* geometry) {
    const Shape& shape = spec.shape;
    const double r = shape.radius_m(), h = shape.half_length_m();
    switch (shape.kind) {
      case ShapeKind::none:
        return nullptr;
      case ShapeKind::sphere:
        return dCreateSphere(space_, r);
      case ShapeKind::box: {
        const Vec3 a = shape.half_extents_m();
        return dCreateBox(space_, 2 * a.x, 2 * a.y, 2 * a.z);
      }
      case ShapeKind::half_space: {
        const Vector n = to_eigen(spec.q_WB).normalized() * Vector::UnitZ();
        return dCreatePlane(space_, n.x(), n.y(), n.z(), n.dot(to_eigen(spec.p_WBo)));
      }
      case ShapeKind::capsule:
        return dCreateCapsule(space_, r, 2 * h);
      case ShapeKind::cylinder:
        return dCreateCylinder(space_, r, 2 * h);
      case ShapeKind::hull:
        return hull_of(std::get<ConvexHull>(geometry->value));
      case ShapeKind::mesh:
        return mesh_of(std::get<TriangleMesh>(geometry->value));
      default:
        throw PeerError("ode has no such shape");
    }
  }

  dGeomID hull_of(const ConvexHull& hull) {
    HullData& data = hulls_.emplace_back();
    for (const Vector& v : hull.vertices)
      data.points.insert(data.points.end(), {v.x(), v.y(), v.z()});
    for (std::size_t f = 0; f < hull.face_count(); ++f) {
      const Vector& n = hull.normals[f];
      data.planes.insert(data.planes.end(), {n.x(), n.y(), n.z(), hull.offsets[f]});
      data.faces.push_back(static_cast<unsigned>(hull.face(f).size()));
      for (const auto corner : hull.face(f)) data.faces.push_back(static_cast<unsigned>(corner));
    }
    return dCreateConvex(space_, data.planes.data(), static_cast<unsigned>(hull.face_count()),
                         data.points.data(), static_cast<unsigned>(hull.vertices.size()),
                         data.faces.data());
  }

  dGeomID mesh_of(const TriangleMesh& mesh) {
    MeshData& data = meshes_.emplace_back();
    for (const Vector& v : mesh.vertices)
      data.vertices.insert(data.vertices.end(), {v.x(), v.y(), v.z()});
    for (const Triangle& t : mesh.triangles)
      for (const auto corner : t) data.triangles.push_back(static_cast<dTriIndex>(corner));
    dGeomTriMeshDataBuildDouble(data.id, data.vertices.data(), 3 * sizeof(double),
                                static_cast<int>(mesh.vertices.size()), data.triangles.data(),
                                static_cast<int>(data.triangles.size()), 3 * sizeof(dTriIndex));
    dGeomTriMeshDataPreprocess2(data.id, 1U << dTRIDATAPREPROCESS_BUILD_FACE_ANGLES, nullptr);
    return dCreateTriMesh(space_, data.id, nullptr, nullptr, nullptr);
  }

  Library library_;
  double step_s_;
  int steps_;
  std::deque<MeshData> meshes_;
  std::deque<HullData> hulls_;
  std::deque<Placed> bodies_;  // where they are, geometries point at
  dWorldID world_ = dWorldCreate();
  dSpaceID space_ = dHashSpaceCreate(nullptr);
  dJointGroupID contacts_ = dJointGroupCreate(0);
};

}  // namespace

std::unique_ptr<Peer> make_ode(const WorldSettings& world, const PeerSettings& settings) {
  return std::make_unique<OdePeer>(world, settings);
}

}  // namespace cradle::bench
