#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "contact/soft_touches.h"
#include "scene/run/record_log.h"

namespace porthos::scene {

struct Assembly;
struct RunReport;

/// How deep the shapes of soft contacts sink into each other, from the records of a run.
class ContactDepths {
 public:
  /// The assembly must outlive it.
  ContactDepths(const Assembly& assembly, const RecordLayout& layout);
  bool any() const { return !worst_.empty(); }
  /// Adds a record, a row of the layout.
  void see(std::span<const double> record);
  /// Adds a note for each contact that sank deeper than a quarter of its shape's half-size.
  void fill(RunReport& report) const;

 private:
  struct Worst {
    std::string name;
    double depth = 0, half_size = 0, time = 0;
  };
  RecordLayout layout_;
  std::optional<contact::SoftTouches> contacts_;
  std::vector<Worst> worst_;
  phs::State state_;
};

}  // namespace porthos::scene
