#include "tests/bench/peer.h"

#include <algorithm>

namespace cradle::bench {
namespace {

void require(bool is_so, const char* what) {
  if (!is_so) throw PeerError(std::string("peers are not given ") + what);
}

const StoredGeometry* stored_geometry_of(const Scene& scene, const Shape& shape) {
  if (!is_stored(shape.kind)) return nullptr;
  return scene.geometries.at(static_cast<std::size_t>(shape.parameters[0]) - 1).get();
}

}  // namespace

std::unique_ptr<Peer> make_peer(const PeerLibrary& library, const Scene& scene,
                                const PeerSettings& settings) {
  require(std::ranges::none_of(scene.drags, &Drag::any), "drag");
  require(scene.springs.empty(), "springs");
  require(scene.wrenches.empty(), "wrenches");
  require(!scene.settings.is_planar, "planar worlds");
  std::unique_ptr<Peer> peer = library.make(scene.settings, settings);
  for (const BodySpec& body : scene.bodies) {
    require(body.kind != BodyKind::kinematic, "kinematic bodies");
    BodyMass mass;
    if (body.kind == BodyKind::dynamic) {
      mass = mass_of(scene, body);
      const Matrix& J = mass.J_kgm2;
      const Matrix off_axis = J - Matrix(J.diagonal().asDiagonal());
      require(off_axis.norm() <= 1e-9 * J.norm(), "inertia about other axes than the body's");
      require(mass.p_BoBcm.norm() <= 1e-6, "bodies with a centre of mass beside their origin");
    }
    peer->add(body, mass, stored_geometry_of(scene, body.shape));
  }
  return peer;
}

}  // namespace cradle::bench
