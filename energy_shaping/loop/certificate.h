#pragma once
#include <limits>
#include <string>
#include <vector>

namespace porthos::energy_shaping {

/// The result for a condition of a certificate; a figure without a bound is reported. not_judged:
/// it could not be checked, and the item's text says why.
enum class Finding { holds, fails, reported, not_judged };

/// For texts: without the sign that a NaN may have.
inline double unsigned_nan(double x) {
  return x == x ? x : std::numeric_limits<double>::quiet_NaN();
}

/// One line of a certificate: a condition with its number and bound, or a figure that is reported
/// without a bound.
struct CertificateItem {
  std::string name;  ///< "matching, potential energy"
  Finding finding = Finding::reported;
  double value = 0;
  double bound = std::numeric_limits<double>::quiet_NaN();  ///< NaN: none
  std::string text;                                         ///< what was checked, in a few words
  std::vector<double> numbers;                              ///< further figures: eigenvalues, ...
  std::vector<double> at;  ///< state or coordinates of the worst value; may be empty
  /// What to do where it fails, in place of that of its condition; empty: that of its condition.
  /// Of a figure that is reported: what to say though all conditions hold
  std::string help = {};
};

/// The verified conditions of a closed loop, and how they were verified.
class Certificate {
 public:
  explicit Certificate(std::string title = {}) : title_(std::move(title)) {}

  const std::string& title() const { return title_; }
  const std::vector<CertificateItem>& items() const { return items_; }
  std::vector<CertificateItem>& items() { return items_; }
  /// @throws InvalidArgument for an unknown name
  const CertificateItem& item(const std::string& name) const;
  bool has(const std::string& name) const;
  void add(CertificateItem item) { items_.push_back(std::move(item)); }
  /// value <= bound.
  void at_most(const std::string& name, double value, double bound, const std::string& text,
               std::vector<double> at = {});
  /// value <= bound, of all that is checked under this name: the largest value stays, with its
  /// text.
  void all_at_most(const std::string& name, double value, double bound, const std::string& text);
  /// value >= bound.
  void at_least(const std::string& name, double value, double bound, const std::string& text,
                std::vector<double> at = {});
  void report(const std::string& name, double value, const std::string& text,
              std::vector<double> numbers = {}, std::vector<double> at = {});

  /// What to do where the item that was added last fails, in place of that of its condition; of a
  /// figure what the last line says beside "all conditions hold".
  void help(std::string what) { items_.back().help = std::move(what); }

  /// No item fails, and none is not judged.
  bool holds() const { return failure() == nullptr; }
  /// The first item that fails or is not judged, or nullptr.
  const CertificateItem* failure() const;
  /// The names of the coordinates of `at`, which text(), html() and refusals then tell with its
  /// numbers: as many, or half as many where `at` is a state.
  void name_coordinates(std::vector<std::string> names) { coordinates_ = std::move(names); }
  const std::vector<std::string>& coordinates() const { return coordinates_; }
  /// The text of an item with its further figures and its place.
  std::string about(const CertificateItem& item) const;
  /// A table for people.
  std::string text() const;
  /// The same table for pages and notebooks, with the title before it; everything is escaped.
  std::string html() const;
  /// The same for programs: {"title", "holds", "items": [{"name", "finding", "value", "bound",
  /// ...}]}; an item that fails or is not judged has its "remedy".
  std::string json() const;

 private:
  std::string title_;
  std::vector<CertificateItem> items_;
  std::vector<std::string> coordinates_;
};

/// What to do where the condition of this name fails, in one sentence. All conditions of a run
/// ("run at 20 ms") have one of two sentences. Empty: the text of the item says it.
std::string remedy(const std::string& condition);
/// The same of an item, by its `help` if it has one.
std::string remedy(const CertificateItem& item);

}  // namespace porthos::energy_shaping
