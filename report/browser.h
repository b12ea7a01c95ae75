#pragma once
#include <atomic>
#include <filesystem>
#include <memory>
#include <string>

/// A Chromium without a window, steered over two pipes (Chrome DevTools Protocol).
namespace porthos::report {

/// The program: PORTHOS_CHROMIUM of the environment, else chromium, google-chrome and the like in
/// PATH.
/// @throws InvalidArgument if there is none: "<before>no Chromium ...; <otherwise>"
std::filesystem::path find_browser(const std::string& before, const std::string& otherwise);

/// A page that is open in a browser of its own, which ends with this object.
class BrowserPage {
 public:
  /// Opens a file. @param width, height  of the page [pixels]
  /// @param stop  true: whatever waits gives up with an IoError
  /// @throws InvalidArgument if the browser is no program
  /// @throws IoError if it does not answer within 60 s
  BrowserPage(const std::filesystem::path& browser, const std::filesystem::path& file,
              const std::string& fragment, int width, int height,
              const std::atomic<bool>* stop = nullptr);
  ~BrowserPage();
  BrowserPage(const BrowserPage&) = delete;
  BrowserPage& operator=(const BrowserPage&) = delete;

  /// The value of an expression of JavaScript as JSON, awaited if it is a promise.
  /// @throws IoError with the text of what the expression throws; as the constructor
  std::string value(const std::string& expression);
  /// The `data` that a method of the protocol answers with, as "Page.printToPDF": base64 as JSON.
  /// @param parameters  JSON
  /// @throws IoError as the constructor
  std::string data(const std::string& method, const std::string& parameters);

 private:
  class Process;
  std::unique_ptr<Process> process_;
};

}  // namespace porthos::report
