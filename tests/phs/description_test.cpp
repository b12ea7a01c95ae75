// A description whose slices do not fit is refused where the model is made, by name and range.
#include <algorithm>
#include <string>
#include <vector>

#include "phs/system/user_model.h"
#include "tests/support/bounds.h"

namespace porthos::phs::description_test {
namespace {

/// Two free masses with forces on them.
struct Described {
  Description said;
  Description description() const { return said; }
  template <class T>
  T hamiltonian(std::span<const T> x) const {
    return T(0.5) * (x[2] * x[2] + x[3] * x[3]);
  }
};

Block block(const std::string& name, int at, int size, int momentum,
            BlockKind kind = BlockKind::linear) {
  return {name, kind, at, size, momentum, "m", "kg m/s"};
}
Port port(const std::string& name, int at, int size) {
  return {name, PortKind::effort_in, size, at, "N", "m/s"};
}
Description described(std::vector<Block> blocks, std::vector<Port> ports = {}) {
  return {"masses", 4, 2, std::move(blocks), std::move(ports), {}, {.canonical = true}};
}
std::string refusal_of(const Description& d) {
  return test::refusal([&] { const UserModel model{Described{d}}; });
}

struct WrongSlices {
  Description said;
  std::string expected;  ///< of the refusal, after "system 'masses': "
};
std::vector<WrongSlices> wrong_slices() {
  Description twice = described({});
  twice.invariants = {{"a", 1, 0, 1, ""}, {"b", 1, 0, 1, ""}};
  Description negative = described({});
  negative.nx = -1;
  return {
      {described({block("q", 7, 1, 2)}),
       "block 'q' has at=7 and size=1, expected a slice within 0..4 of x (nx=4)"},
      {described({block("q", -2, 1, 2)}),
       "block 'q' has at=-2 and size=1, expected a slice within 0..4 of x (nx=4)"},
      {described({block("q", 0, 5, -1)}),
       "block 'q' has at=0 and size=5, expected a slice within 0..4 of x (nx=4)"},
      {described({block("q", 0, 0, 2)}),
       "block 'q' has at=0 and size=0, expected a slice within 0..4 of x (nx=4)"},
      {described({block("q", 0, 2, 400000)}),
       "block 'q' has momentum=400000 and size=2, expected a slice within 0..4 of x (nx=4)"},
      {described({block("q", 0, 2147483647, -1)}),
       "block 'q' has at=0 and size=2147483647, expected a slice within 0..4 of x (nx=4)"},
      {described({block("a", 0, 2, 2), block("b", 1, 1, 3)}),
       "block 'b' has at=1 and size=1 in x, where block 'a' has at=0 and size=2, expected slices "
       "that do not overlap"},
      {described({block("a", 0, 2, 1)}),
       "block 'a' has momentum=1 and size=2 in x, where block 'a' has at=0 and size=2, expected "
       "slices that do not overlap"},
      {described({block("a", 0, 1, 3), block("b", 1, 1, 2)}),
       "block 'a' has at=0 and momentum=3, expected momentum=2 (at + nx/2), as traits say that the "
       "system is canonical"},
      {described({block("a", 0, 2, 2, BlockKind::angle)}),
       "block 'a' has size=2, expected 1 for an angle"},
      {described({block("a", 0, 2, 2, BlockKind::rotation)}),
       "block 'a' has size=2, expected 4 for a rotation"},
      {described({}, {port("f", 3, 1)}),
       "port 'f' has at=3 and size=1, expected a slice within 0..2 of u (nu=2)"},
      {described({}, {port("f", 0, 2), port("g", 1, 1)}),
       "port 'g' has at=1 and size=1 in u, where port 'f' has at=0 and size=2, expected slices "
       "that "
       "do not overlap"},
      {twice,
       "invariant 'b' has at=0 and size=1 in the invariants, where invariant 'a' has at=0 and "
       "size=1, expected slices that do not overlap"},
      {negative, "has nx=-1 and nu=2, expected numbers that are not negative"},
  };
}

TEST(Description, WrongSlicesAreRefusedByNameAndRange) {
  const std::string start = "system 'masses': ";
  int accepted = 0;
  size_t longest = 0;
  for (const WrongSlices& w : wrong_slices()) {
    const std::string said = refusal_of(w.said);
    EXPECT_EQ(said, start + w.expected);
    accepted += said.empty();
    longest = std::max(longest, said.size());
  }
  test::keeps("wrong descriptions accepted", accepted, 0);
  test::keeps("characters of the longest refusal", double(longest), 220);
}

// The control: what fits is accepted, also where blocks leave numbers out or have no momentum.
TEST(Description, SlicesThatFitAreAccepted) {
  Description exchanged = described({block("a", 0, 1, 3), block("b", 1, 1, 2)});
  exchanged.traits.canonical = false;  // its structure says what is conjugate
  int accepted = 0;
  for (const Description& d :
       {described({}), described({block("a", 0, 2, 2)}, {port("f", 0, 1), port("g", 1, 1)}),
        described({block("b", 1, 1, 3), block("a", 0, 1, 2)}, {port("g", 1, 1)}),
        described({block("a", 0, 1, -1, BlockKind::angle), block("p", 3, 1, -1)}),
        described({block("attitude", 0, 4, -1, BlockKind::rotation)}), exchanged}) {
    EXPECT_EQ(refusal_of(d), "");
    accepted += refusal_of(d).empty();
  }
  test::breaks("sound descriptions accepted", accepted, 5);
}

}  // namespace
}  // namespace porthos::phs::description_test
