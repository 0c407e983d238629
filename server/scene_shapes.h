/// What the shape keys of a scene's [[body]] mean, those of its [[body.part]] included.
#pragma once

#include <cradle/result.h>
#include <cradle/types.h>

#include <map>
#include <string>
#include <vector>

#include "server/dynamics/mass_properties.h"
#include "server/toml_reader.h"

namespace cradle {

/// The rest of the sentence "key: ..." for a value that is refused.
std::string reason(Result result);

/// Refuses the key unless the result is ok.
void require(const TomlTable& table, std::string_view key, Result result);

/// `orientation_wxyz` or `rotation_rad`, at most one of them; leaves `q` alone where both are
/// absent.
void read_orientation(const TomlTable& table, Quat& q);

/// Reads shapes, and collects the geometry that does not fit one. For one scene.
class ShapeReader {
 public:
  /// `scene` is the path that files in it are relative to.
  explicit ShapeReader(const std::string& scene);

  /// Reads all shape keys of a body into `spec.shape`, and judges them; its kind must be known.
  void read(const TomlTable& table, BodySpec& spec);

  /// Of a planar world, or one of space, as it is at first: which shapes there are, and what they
  /// weigh.
  void set_planar(bool is_planar) { is_planar_ = is_planar; }

  /// What a body weighs whose shape was read.
  Result mass_of(const BodySpec& spec, MassProperties& mass) const;

  /// Those of the bodies: number k is the one at k - 1.
  std::vector<GeometryPointer> take_geometries() { return std::move(geometries_); }

 private:
  Shape read_simple(const TomlTable& table, ShapeKind kind) const;
  GeometryPointer read_surface(const TomlTable& table, Shape& shape);
  GeometryPointer read_polygon(const TomlTable& table, Shape& shape) const;
  GeometryPointer read_file(const TomlTable& table, ShapeKind kind, const std::string& file);
  GeometryPointer read_field(const TomlTable& table, ShapeKind kind);
  GeometryPointer read_compound(const TomlTable& table, const std::vector<TomlTable>& parts);
  CompoundPart read_part(const TomlTable& table);

  std::string scene_;
  bool is_planar_ = false;
  std::map<std::pair<ShapeKind, std::string>, GeometryPointer> files_;  ///< read already
  std::vector<GeometryPointer> geometries_;
  std::vector<MassDistribution> masses_;
};

}  // namespace cradle
