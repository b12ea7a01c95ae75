#pragma once
#include <array>
#include <span>
#include <vector>

#include "mechanics/mechanism.h"

namespace porthos::planning {

/// How a machine steps on level ground. Each foot swings once in a period.
struct GaitDesign {
  double period = 0;          ///< in which each foot swings once [s]
  double duty = 0.6;          ///< the part of the period in which a foot stands
  std::vector<double> swing;  ///< of each foot: the part of the period where its swing begins
  std::array<double, 2> velocity{0, 0};  ///< that is wanted, along x and y [m/s]
  double clearance = 0.05;               ///< of a foot in the middle of its swing [m]
  double reach = 0.3;    ///< how far from its place under the centre of mass it may land [m]
  double spacing = 0.7;  ///< the least distance of feet, as part of that at the start
  double start = 0;      ///< of the first step [s]
  /// It steps only when the capture point is less than `margin` inside the edge of the feet. It
  /// stops after a whole period, when all feet stand and the point is twice as far inside.
  bool when_pushed = false;
  double margin = 0.03;  ///< [m]
};

/// Steps of a machine whose centre of mass moves as a linear inverted pendulum of height z:
/// x'' = ω² (x - p), ω² = g/z, p the zero moment point. ξ = x + x'/ω, the capture point (divergent
/// component of motion), obeys ξ' = ω (ξ - p): it leaves p, and x follows it. In the steady gait p
/// is the middle of the feet that stand, and ξ has at each landing a constant offset from the foot.
/// A foot lands at this offset from where ξ will be, so it makes up for what disturbed the step.
/// Sources: Hof 2008 (Hum. Mov. Sci. 27); Englsberger, Ott, Albu-Schäffer 2015 (IEEE Trans. Robot.
/// 31).
class Gait {
 public:
  using Vec3d = mechanics::Vec3d;

  /// @param feet    at the start, on the ground [m]
  /// @param height  of the centre of mass above the ground [m]
  /// @param g       [m/s²]
  /// @throws InvalidArgument naming the number: out of its range, not one swing for each foot, a
  ///   part of the period in which no foot stands
  Gait(GaitDesign design, std::vector<Vec3d> feet, double height, double g);

  /// What is known at an instant.
  struct Seen {
    double t, dt;               ///< now, until the next instant [s]
    Vec3d centre, moving;       ///< of the centre of mass [m, m/s]
    std::vector<Vec3d> feet;    ///< [m]
    std::vector<char> closed;   ///< whether a foot is on the ground
    std::vector<Vec3d> points;  ///< of all feet on the ground: the corners of the support
  };
  /// A foot that is not to stand on the ground now, or does not yet, and where it should be.
  struct Swing {
    bool lifted = false, moves = false;
    Vec3d at, rate, acceleration;  ///< world [m, m/s, m/s²]
  };
  struct Plan {
    std::vector<Swing> feet;
    Vec3d pivot;            ///< the middle of the feet that stand [m]
    Vec3d capture, wanted;  ///< ξ and where it is to be [m]
  };

  /// Numbers in the memory of a run, and those before its first instant.
  size_t size() const { return of_all + of_foot * n_.size(); }
  /// The plan at an instant; the memory goes on to the next one.
  Plan plan(const Seen& seen, std::span<double> memory) const;

  /// Horizontal acceleration of the centre of mass with which ξ comes to where it is wanted as
  /// e^{-kt}: ω² (x - p), p = pivot + (1 + k/ω)(ξ - ξ_d). @param k  [1/s]
  Vec3d acceleration(const Plan& p, const Vec3d& centre, double k) const;
  double omega() const { return w_; }
  /// The offset of the capture point from a foot when it lands, in the steady gait [m].
  Vec3d landing_offset(size_t foot) const { return offset_[foot]; }

  // Where the memory has what users see: ξ, and of each foot where it lands.
  static constexpr size_t capture_at = 4;
  static size_t footstep_at(size_t foot) { return of_all + of_foot * foot; }
  /// Swings that began, and when the first did [s].
  static double steps(std::span<const double> memory) { return memory[2]; }
  static double first(std::span<const double> memory) { return memory[3]; }

 private:
  static constexpr size_t of_all = 7, of_foot = 11;
  /// A part of the period in which the same feet stand.
  struct Part {
    double begin, duration;  // [s]
    std::vector<char> stands;
    Vec3d pivot, capture;  // in the steady gait, at its begin
  };
  size_t part_at(double phase) const;
  Vec3d middle(const Seen& s, const std::vector<char>& stands) const;
  void begin_or_end(const Seen& s, const Vec3d& xi, std::span<double> memory) const;
  Vec3d landing(const Seen& s, size_t foot, const Plan& p, double rest,
                const std::vector<char>& stands) const;
  void swing(const Seen& s, size_t foot, double phase, Plan& p, const std::vector<char>& stands,
             std::span<double> own) const;

  GaitDesign d_;
  std::vector<Vec3d> n_;  ///< of each foot from the middle of all
  double ground_, w_;
  std::vector<Part> parts_;
  std::vector<Vec3d> offset_;
};

}  // namespace porthos::planning
