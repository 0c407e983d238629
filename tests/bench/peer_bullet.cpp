// Bullet as Debian builds it, in float, with its defaults: ten iterations of the sequential impulse
// solver, split impulses, restitution above 0.2 m/s, margins of 4 cm, implicit gyroscopic forces.
// No continuous collision: a body has that only where its user asks for it. Sleeping is off.
#include <btBulletDynamicsCommon.h>

#include <cmath>
#include <vector>

#include "tests/bench/peer.h"

namespace cradle::bench {
namespace {

btScalar scalar(double value) { return static_cast<btScalar>(value); }
btVector3 to_bullet(const Vec3& v) { return {scalar(v.x), scalar(v.y), scalar(v.z)}; }
btVector3 to_bullet(const Vector& v) { return to_bullet(to_plain(v)); }
Vec3 from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

// Bullet multiplies; ours is the root of the product, and the larger.
btScalar friction_of(const btCollisionObject* a, const btCollisionObject* b) {
  return std::sqrt(a->getFriction() * b->getFriction());
}
btScalar restitution_of(const btCollisionObject* a, const btCollisionObject* b) {
  return std::max(a->getRestitution(), b->getRestitution());
}

class BulletPeer final : public Peer {
 public:
  BulletPeer(const WorldSettings& world, const PeerSettings& settings)
      : step_s_(scalar(1 / (world.rate_hz * settings.steps_a_tick))),
        steps_(settings.steps_a_tick) {
    gCalculateCombinedFrictionCallback = friction_of;
    gCalculateCombinedRestitutionCallback = restitution_of;
    world_.setGravity(to_bullet(world.gravity_W));
    if (settings.iterations > 0) world_.getSolverInfo().m_numIterations = settings.iterations;
  }

  void add(const BodySpec& spec, const BodyMass& mass, const StoredGeometry* geometry) override {
    shapes_.push_back(shape_of(spec.shape, geometry));
    btRigidBody::btRigidBodyConstructionInfo info(scalar(mass.mass_kg), nullptr,
                                                  shapes_.back().get(),
                                                  to_bullet(Vector(mass.J_kgm2.diagonal())));
    const Quat& q = spec.q_WB;
    info.m_startWorldTransform.setRotation(
        btQuaternion(scalar(q.x), scalar(q.y), scalar(q.z), scalar(q.w)).normalized());
    info.m_startWorldTransform.setOrigin(to_bullet(spec.p_WBo));
    info.m_friction = scalar(spec.material.friction);
    info.m_restitution = scalar(spec.material.restitution);
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    btRigidBody& body = *bodies_.back();
    body.setLinearVelocity(to_bullet(spec.v_WBcm));
    body.setAngularVelocity(to_bullet(spec.w_WB));
    if (spec.kind == BodyKind::dynamic) body.setActivationState(DISABLE_DEACTIVATION);
    if (spec.shape.kind == ShapeKind::none) {
      world_.addRigidBody(&body, 0, 0);  // Bullet leaves out what has no shape at all
    } else {
      world_.addRigidBody(&body);
    }
  }

  void step() override {
    for (int i = 0; i < steps_; ++i) world_.stepSimulation(step_s_, 0);
  }

  BodyState state(std::size_t number) const override {
    const btRigidBody& body = *bodies_[number];
    const btQuaternion q = body.getWorldTransform().getRotation();
    BodyState state;
    state.p_WBo = from_bullet(body.getWorldTransform().getOrigin());
    state.q_WB = {q.w(), q.x(), q.y(), q.z()};
    state.v_WBcm = from_bullet(body.getLinearVelocity());
    state.w_WB = from_bullet(body.getAngularVelocity());
    return state;
  }

 private:
  std::unique_ptr<btCollisionShape> shape_of(const Shape& shape, const StoredGeometry* geometry) {
    const btScalar r = scalar(shape.radius_m()), h = scalar(shape.half_length_m());
    switch (shape.kind) {
      case ShapeKind::none:
        return std::make_unique<btEmptyShape>();
      case ShapeKind::sphere:
        return std::make_unique<btSphereShape>(r);
      case ShapeKind::box:
        return std::make_unique<btBoxShape>(to_bullet(shape.half_extents_m()));
      case ShapeKind::half_space:
        return std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0));
      case ShapeKind::capsule:
        return std::make_unique<btCapsuleShapeZ>(r, 2 * h);
      case ShapeKind::cylinder:
        return std::make_unique<btCylinderShapeZ>(btVector3(r, r, h));
      case ShapeKind::hull: {
        auto hull = std::make_unique<btConvexHullShape>();
        for (const Vector& v : std::get<ConvexHull>(geometry->value).vertices)
          hull->addPoint(to_bullet(v), false);
        hull->recalcLocalAabb();
        return hull;
      }
      case ShapeKind::mesh:
        return mesh_of(std::get<TriangleMesh>(geometry->value));
      default:
        throw PeerError("bullet is not given this kind of shape");
    }
  }

  std::unique_ptr<btCollisionShape> mesh_of(const TriangleMesh& mesh) {
    meshes_.push_back(std::make_unique<btTriangleMesh>());
    for (const Triangle& t : mesh.triangles) {
      const auto corner = [&](std::size_t k) {
        return to_bullet(mesh.vertices[static_cast<std::size_t>(t[k])]);
      };
      meshes_.back()->addTriangle(corner(0), corner(1), corner(2));
    }
    return std::make_unique<btBvhTriangleMeshShape>(meshes_.back().get(), true);
  }

  btScalar step_s_;
  int steps_;
  // The world, which looks at its bodies when it ends, comes last.
  std::vector<std::unique_ptr<btTriangleMesh>> meshes_;
  std::vector<std::unique_ptr<btCollisionShape>> shapes_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broad_phase_, &solver_, &configuration_};
};

}  // namespace

std::unique_ptr<Peer> make_bullet(const WorldSettings& world, const PeerSettings& settings) {
  return std::make_unique<BulletPeer>(world, settings);
}

}  // namespace cradle::bench
