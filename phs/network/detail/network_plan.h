#pragma once
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "phs/network/network.h"

/// What a Network has collected, and what build() derives from it. Private to network*.cpp.
namespace porthos::phs {

struct Network::Plan {
  /// value[row] += factor · other[col], where `other` is another vector
  struct Term {
    int row, col;
    double factor;
  };
  struct Member {
    std::string name;
    std::shared_ptr<const Model> model;
    int x = 0, nx = 0, u = 0, nu = 0;  ///< offsets and sizes of its state and inputs
    int angle = 0, angles = 0;         ///< offset and count of its turn angles
    bool active = false;               ///< something acts on its ports
    bool main = false;                 ///< its names get no prefix
    int stored = 0, powers = 0;        ///< offsets of its ledger
  };
  struct Law {
    std::string name;
    int row;
    FunctionPtr law;
  };
  struct Bristle {
    std::string name;
    int rate, force;  ///< rows of the port it rubs at and of the member that stores its energy
    LuGre law;
  };
  struct Rayleigh {
    std::string name;
    std::vector<Term> D;
  };
  struct Source {
    std::string name;
    int row;
    FunctionPtr v;
  };
  struct Control {
    std::string name;
    int row, size, member;
    LawPtr law;
    HoldPtr hold = nullptr;         ///< null: continuous
    std::vector<int> sensors = {};  ///< rows of the outputs it sees besides its port's
    /// per component, the coordinate whose change gives the mean flow; empty: the flow itself
    std::vector<int> encoder = {};
    GatePtr gate = nullptr;  ///< null: always open
    int tank = -1;           ///< number of the tank that pays, -1: none
    bool whole = false;      ///< it sees the state of the whole network
    /// Where its memory begins in that of the hold, behind values and encoder.
    size_t gate_at() const { return size_t(size) + encoder.size(); }
  };
  /// A controller whose law has a memory.
  struct SampledControl {
    std::string name;
    int member;
    std::vector<int> rows;  ///< of its ports, in turn
    SampledLawPtr law;
    HoldPtr hold;  ///< its memory: the held values, then the law's
    int tank = -1;
  };
  struct Tank {
    std::string name;
    int member, x;  ///< x: offset of its energy in the state
    double least, most;
  };
  /// Dampers whose power flows into a tank in part.
  struct FillingDamper {
    std::string name;
    std::vector<int> rows;
    std::vector<double> d;
    double fill;
    int tank;
  };
  struct Spring {
    std::string name;
    int q, p;  ///< offsets in the state
    int turn;  ///< its angle, -1 for none
    Potential U;
  };
  struct BlockSpring {
    std::string name;
    int q, p, size;  ///< offsets in the state
    BlockPotentialPtr U;
    /// Numbers of the coordinate in a vector like x.
    template <class T>
    std::span<T> of(std::span<T> x) const {
      return x.subspan(size_t(q), size_t(size));
    }
  };
  /// An invariant of a member that the composition keeps.
  struct Kept {
    int member, at;  ///< offset in the member's invariants
  };

  std::string name;
  std::vector<Member> members;
  std::vector<Law> laws;
  std::vector<Bristle> bristles;
  std::vector<Rayleigh> rayleighs;
  std::vector<Source> sources;
  std::vector<Control> controls;
  std::vector<SampledControl> sampled;
  std::vector<Tank> tanks;
  std::vector<FillingDamper> filling;
  std::vector<Spring> springs;
  std::vector<BlockSpring> block_springs;
  std::vector<Term> K, F;          ///< u = K y + ..., y = Gᵀe + F u
  std::vector<std::string> joint;  ///< per input: the junction that its port is part of, or empty

  // made by build()
  Description description;
  std::vector<Term> B, M;       ///< u = B Gᵀe + M v; M empty: the identity
  std::vector<Term> skew, sym;  ///< parts of B
  std::vector<int> open;        ///< inputs left open for the user
  std::vector<int> turn_of;     ///< per number of the state: its angle, or -1
  std::vector<Kept> kept;
  std::vector<Casimir> casimirs;

  /// Inputs that a source, a controller or a damper of a tank drives.
  std::vector<int> pushed() const {
    std::vector<int> rows;
    for (const auto& s : sources) rows.push_back(s.row);
    for (const auto& c : controls)
      for (int k = 0; k < c.size; ++k) rows.push_back(c.row + k);
    for (const auto& c : sampled) rows.insert(rows.end(), c.rows.begin(), c.rows.end());
    for (const auto& f : filling) rows.insert(rows.end(), f.rows.begin(), f.rows.end());
    return rows;
  }
  /// Offset and size of the state that a controller's law sees.
  std::pair<size_t, size_t> seen(const Control& c) const {
    const Member& m = members[size_t(c.member)];
    return c.whole ? std::pair(size_t(0), size_t(nx())) : std::pair(size_t(m.x), size_t(m.nx));
  }
  int nx() const { return members.empty() ? 0 : members.back().x + members.back().nx; }
  int nu() const { return members.empty() ? 0 : members.back().u + members.back().nu; }
};

/// to[first of s + k] += sign · ∂U/∂z_k of a spring on a block at x. first: its q or p.
template <class T>
void add_slope(const Network::Plan::BlockSpring& s, std::span<const T> x, double sign, int first,
               std::span<T> to) {
  T slope[most_of_a_block];
  s.U->slope(s.of(x), std::span<T>(slope, size_t(s.size)));
  for (int k = 0; k < s.size; ++k)
    to[size_t(first + k)] = to[size_t(first + k)] + T(sign) * slope[k];
}

/// uᵀy
template <class T>
T power(std::span<const T> u, std::span<const T> y) {
  T sum(0.0);
  for (size_t k = 0; k < u.size(); ++k) sum = sum + u[k] * y[k];
  return sum;
}

/// yᵀA y
template <class T>
T quadratic_form(const std::vector<Network::Plan::Term>& A, const std::vector<T>& y) {
  T sum(0.0);
  for (const auto& a : A) sum = sum + y[size_t(a.row)] * T(a.factor) * y[size_t(a.col)];
  return sum;
}

/// The power that the feedthrough of each member dissipates, uᵀF u, from place `to` on.
/// @return the place after the last
template <class T>
size_t feedthrough_powers(const Network::Plan& p, const std::vector<T>& u, std::span<T> values,
                          size_t to) {
  for (const auto& m : p.members) {
    T sum(0.0);
    bool any = false;
    for (const auto& f : p.F)
      if (f.row >= m.u && f.row < m.u + m.nu) {
        any = true;
        sum = sum + u[size_t(f.row)] * T(f.factor) * u[size_t(f.col)];
      }
    if (any) values[to++] = sum;
  }
  return to;
}

/// Fills kept, casimirs and the invariants of the description.
void find_invariants(Network::Plan& plan);

}  // namespace porthos::phs
