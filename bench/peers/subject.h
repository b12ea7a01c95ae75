#pragma once
#include <Eigen/Dense>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mechanics/mechanism.h"

/// The same models and states, put before Porthos and before libraries that do the same work.
namespace porthos::bench {

using Vec = std::vector<double>;

/// A model and states made outside the timed region, in Porthos' conventions: v, tau, a of a free
/// base are [angular; linear] in the base's axes.
struct Case {
  std::shared_ptr<const mechanics::Mechanism> model;
  std::vector<Vec> q, v, tau;
  int states() const { return int(q.size()); }
};
Case make_case(std::shared_ptr<const mechanics::Mechanism> model, int states = 64);

/// One library on one case. The timed functions take the number of a state; empty: the library does
/// not offer it.
struct Subject {
  std::string name;
  std::function<void(int)> aba, rnea, crba;
  /// Inverse and forward dynamics with all derivatives by coordinates, rates and torques.
  std::function<void(int)> rnea_derivatives, aba_derivatives;
  std::function<void(int)> hessian;  ///< of H(q, p), all of it; may be empty
  // What it found, in Porthos' conventions, for the check before anything is timed. No Eigen here:
  // how it aligns is the library's choice (dart.cpp).
  std::function<Vec(int)> acceleration,
      torque,                ///< of v̇ = tau, a number like any other; may be empty
      mass_matrix,           ///< by columns; may be empty
      torque_slopes,         ///< by coordinates and rates, by columns; may be empty
      acceleration_slopes;   ///< by coordinates, rates and torques; may be empty
  double tolerance = 1e-10;  ///< largest relative difference from Porthos that counts as agreement
};

Subject porthos_subject(const Case&);
// Those of libraries that are not here (PORTHOS_PEER_...) have no definition.
Subject rbdl_subject(const Case&);
Subject pinocchio_subject(const Case&);
Subject mujoco_subject(const Case&);
Subject simbody_subject(const Case&);
Subject bullet_subject(const Case&);
Subject dart_subject(const Case&);

/// How a peer writes the rates of a free base: which half first, each half in world or in body
/// axes, and the point of the base, in body axes, whose velocity the linear half is.
struct Convention {
  bool angular_first = false, world_linear = false, world_angular = false;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();

  static bool free_base(const mechanics::Mechanism& m);
  /// T with (peer's rates) = T (Porthos' rates).
  Eigen::MatrixXd rates(const mechanics::Mechanism& m, const Vec& q) const;
  Eigen::VectorXd to_peer(const mechanics::Mechanism& m, const Vec& q, const Vec& v) const;
  Eigen::VectorXd force_to_peer(const mechanics::Mechanism& m, const Vec& q, const Vec& tau) const;
  /// Accelerations: the derivative of the world's components has ω × v in it, that of the body's
  /// has not.
  Eigen::VectorXd acceleration_to_peer(const mechanics::Mechanism& m, const Vec& q, const Vec& v,
                                       const Vec& a) const;
  /// The functions of the check, from the timed ones and from what they leave in the peer's
  /// convention: accelerations, forces, the whole mass matrix. An algorithm without one is not
  /// checked.
  using Left = std::function<Eigen::VectorXd()>;
  void add_checks(Subject&, const Case&, Left accelerations, Left forces,
                  std::function<Eigen::MatrixXd()> mass_matrix) const;
};

/// The constants of a node as the peers want them.
struct PeerBody {
  Eigen::Matrix3d R;  ///< child to parent at q = 0; the joint's axis is z
  Eigen::Vector3d r, com;
  double mass;
  Eigen::Matrix3d inertia_at_com;
};
/// @throws std::runtime_error for joints the comparison does not cover: revolute, prismatic and a
///   free root
PeerBody peer_body(const mechanics::Mechanism& m, int node);
bool is_joint(const mechanics::Mechanism& m, int node, std::string_view name);

}  // namespace porthos::bench
