#pragma once
#include <chrono>

namespace porthos::apps {

/// Progress on stderr: a bar with the time left on a terminal, otherwise a line about every five
/// seconds.
class Progress {
 public:
  Progress();
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// @param fraction  0 to 1;  spent, left  wall-clock seconds
  void update(double fraction, double spent, double left);
  /// The same, spent since this object was made, left in proportion.
  void update(double fraction);
  /// Removes the bar, so that the next output starts on a clean line.
  void finish();

 private:
  bool terminal_, drawn_ = false;
  std::chrono::steady_clock::time_point begun_, last_;
};

}  // namespace porthos::apps
