#pragma once
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "contact/geometry/shape.h"
#include "mechanics/mechanical_model.h"
#include "report/detail/mesh_shelf.h"
#include "report/report.h"
#include "scene/plot/motion.h"

namespace porthos::report {

/// The input of a playback: a mechanism and the records of its motion.
struct Stage {
  std::shared_ptr<const mechanics::Mechanism> mechanism;
  std::vector<mechanics::BodySpec> bodies;  ///< its bodies as built
  std::string urdf;
  std::map<std::string, std::vector<contact::Shape>> touching;  ///< that contacts state, by link
  std::vector<contact::Shape> world;  ///< shapes of the world that contacts touch
  std::vector<std::pair<std::string, std::string>> wrenches;  ///< outputs joint_wrench: name, joint
  std::vector<scene::Spring> springs;                         ///< of actuators
  mechanics::Vec3d gravity{0, 0, 0};  ///< of the scene, whether or not the mechanism feels it
  scene::WholeRun run;                ///< for the motion of each phase
  bool recorded = false;              ///< of a judged file, which may lack rows
  const Records* records = nullptr;
  MeshShelf* meshes = nullptr;
};

/// What places are relative to, so that floats are accurate enough however far a body has drifted:
/// the place of the first body if it is free in the world and no link stands there, else 0.
/// @param pose  of every moving body
mechanics::Vec3d origin_of(const mechanics::Mechanism& m,
                           std::span<const mechanics::Transform<double>> pose);
/// Appends seven numbers per body: place relative to the origin, quaternion w x y z.
void add_poses(std::span<const mechanics::Transform<double>> pose, const mechanics::Vec3d& origin,
               std::vector<float>& to);

/// The panels of scene::motion_panels, of no more than `most` values a line (Shown::bands):
/// {t, holes, panels: [{what, lines: [{name, v, held?}]}]}, holes [s]: as those of a panel.
/// whole: the records are of a whole run, not of one of several phases; then panels are those of
/// scene::apart_by_size().
Json motion(const Stage& stage, std::int64_t most, bool whole);

/// Poses of the moving bodies at no more than `most` records, equally far apart: whole run, and
/// where records were left out also its beginning, record by record. part: that
/// of the run alone. {bodies: shapes with node and pose,
/// world: [{kind, size, p, q}] that contacts touch, nodes, clips: [{name, t, origin, poses,
/// orbit?, turn, momenta?, forces}]}: origin [m] of each frame and, relative to it, seven numbers
/// per node (place, quaternion w x y z); turn: the largest rotation of a body or a joint between
/// two frames, from their poses or their rates, in the part [rad]; momenta: nine numbers per frame
/// (centre of mass relative to the origin, momentum, angular momentum about that centre, world
/// axes); forces: [{body, v}], what a joint exerts on the body, in its axes [N].
Json playback(const Stage& stage, std::int64_t most, const Part& part = {});

}  // namespace porthos::report
