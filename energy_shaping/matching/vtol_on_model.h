#pragma once
#include <memory>
#include <string>
#include <vector>

#include "energy_shaping/loop/certificate.h"
#include "energy_shaping/loop/port_law.h"
#include "energy_shaping/matching/designs.h"
#include "mechanics/mechanical_model.h"

namespace porthos::energy_shaping {

/// Where the engine of a planar vehicle acts: two forces in the plane, through one point.
struct Engine {
  std::string link;
  mechanics::Vec3d point{0, 0, 0};  ///< in the link's frame [m]
};

/// The design vtol() for a vehicle of two slides and a hinge: level or upright it moves along two
/// slides, x across and y up, and turns by θ, the hinge at its centre of mass. An engine below that
/// centre has a thrust along the body and a force across it, both through one point, as a gimballed
/// rocket or a pair of thrusters. With m, J and the distance h of the point,
///   m x'' = -sin θ f + cos θ s,   m y'' = cos θ f + sin θ s - m g,   J θ'' = h s
/// which is the plant of the design for u = (x'', y'') and ε = J/(m h): all its numbers are read
/// off the model. The law gives u, the force m (u + g) acts at the point, and the joints get Jᵀ of
/// it.
class VtolOnModel {
 public:
  /// d: k1, k2, k3, P, kv.  rest: q*, 3 numbers; the hinge's is where it hovers
  /// @throws InvalidArgument for a mechanism that is not two slides along fixed lines and a hinge,
  ///   an engine that is not below the centre of mass, a condition of the design that fails, and a
  ///   vehicle that moves under the law otherwise than the design's plant
  VtolOnModel(std::shared_ptr<const mechanics::MechanicalModel> model, const Engine& engine,
              const std::vector<double>& rest, Vtol d);

  /// That of the design, then the comparison of the motions.
  const Certificate& certificate() const { return certificate_; }
  /// Of the two slides and the hinge.
  std::vector<PortLaw> port_laws() const;
  /// The design with the numbers of the model.
  const Vtol& design() const { return data_->design; }

  struct Data {
    std::shared_ptr<const mechanics::MechanicalModel> model;
    std::vector<double> rest;
    Vtol design;
    LoopPtr loop = nullptr;
    mechanics::BodyFrame engine = {};                   ///< its origin is the point
    size_t x = 0, y = 0, hinge = 0;                     ///< coordinates
    double up = 1, turn = 1;                            ///< signs of y and θ in theirs
    double mass = 0;                                    ///< [kg]
    mechanics::Vec3d across{0, 0, 0}, upward = across;  ///< in the world
  };

 private:
  void read(const Engine& engine, const std::vector<double>& rest, Data& data);
  void check_motion();

  std::shared_ptr<const Data> data_;
  Certificate certificate_;
};

}  // namespace porthos::energy_shaping
