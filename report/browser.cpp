#include "report/browser.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <system_error>
#include <vector>

#include "phs/error.h"

namespace porthos::report {
namespace {

constexpr int patience_s = 60;  // for one answer

/// While it lives, a pipe without a reader is an error of write() and no signal.
class WithoutPipeSignal {
 public:
  WithoutPipeSignal() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~WithoutPipeSignal() {
    const timespec now{0, 0};
    while (sigtimedwait(&pipe_, nullptr, &now) > 0) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  WithoutPipeSignal(const WithoutPipeSignal&) = delete;
  WithoutPipeSignal& operator=(const WithoutPipeSignal&) = delete;

 private:
  sigset_t pipe_, before_;
};

std::string file_address(const std::filesystem::path& file, const std::string& fragment) {
  std::string address = "file://";
  for (const unsigned char c : std::filesystem::absolute(file).lexically_normal().string())
    address += std::isalnum(c) || std::string_view("/._-~").find(char(c)) != std::string_view::npos
                   ? std::string(1, char(c))
                   : fmt::format("%{:02X}", c);
  return address + "#" + fragment;
}

}  // namespace

std::filesystem::path find_browser(const std::string& before, const std::string& otherwise) {
  if (const char* given = std::getenv("PORTHOS_CHROMIUM"); given && *given) return given;
  const char* path = std::getenv("PATH");
  for (std::string_view rest = path ? path : ""; !rest.empty();) {
    const auto end = std::min(rest.find(':'), rest.size());
    for (const char* name : {"chromium", "chromium-browser", "google-chrome",
                             "google-chrome-stable", "chrome", "microsoft-edge"}) {
      const std::filesystem::path file = std::filesystem::path(rest.substr(0, end)) / name;
      if (access(file.c_str(), X_OK) == 0 && !std::filesystem::is_directory(file)) return file;
    }
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  throw InvalidArgument(before +
                        "no Chromium or Chrome was found in PATH, expected one, or its path in "
                        "PORTHOS_CHROMIUM; " +
                        otherwise);
}

/// The browser's process and the two pipes: it reads requests from 3 and writes answers to 4. Each
/// is a text of JSON that a zero byte ends.
class BrowserPage::Process {
 public:
  Process(const std::filesystem::path& browser, int width, int height,
          const std::atomic<bool>* stop)
      : stop_(stop) {
    int to[2], from[2];
    if (pipe2(to, O_CLOEXEC) != 0 || pipe2(from, O_CLOEXEC) != 0) fail("no pipe to the browser");
    std::vector<std::string> words{browser.string(),
                                   "--headless=new",
                                   "--remote-debugging-pipe",
                                   "--hide-scrollbars",
                                   "--mute-audio",
                                   "--no-first-run",
                                   "--enable-unsafe-swiftshader",
                                   "--disable-extensions",
                                   fmt::format("--window-size={},{}", width, height),
                                   "--user-data-dir=" + profile_.path.string()};
    if (geteuid() == 0) words.push_back("--no-sandbox");  // which root cannot have
    words.push_back("about:blank");
    std::vector<char*> arguments;
    for (std::string& w : words) arguments.push_back(w.data());
    arguments.push_back(nullptr);
    if (access(browser.c_str(), X_OK) != 0)
      throw InvalidArgument(fmt::format("the browser {} cannot be run: {}", browser.string(),
                                        std::generic_category().message(errno)));
    name_ = browser.string();
    child_ = fork();
    if (child_ < 0) fail("no process for the browser");
    if (child_ == 0) {
      setpgid(0, 0);  // it has children of its own, which end with it
      const int in = fcntl(to[0], F_DUPFD, 10), out = fcntl(from[1], F_DUPFD, 10),
                nowhere = open("/dev/null", O_RDWR);
      for (const int stream : {0, 1, 2}) dup2(nowhere, stream);
      dup2(in, 3);
      dup2(out, 4);
      execve(arguments[0], arguments.data(), environ);
      _exit(127);
    }
    close(to[0]);
    close(from[1]);
    to_ = to[1];
    from_ = from[0];
  }
  ~Process() {
    close(to_);
    close(from_);
    kill(-child_, SIGKILL);
    kill(child_, SIGKILL);
    waitpid(child_, nullptr, 0);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  nlohmann::json ask(const std::string& method, nlohmann::json params) {
    const int id = ++last_id_;
    nlohmann::json request{{"id", id}, {"method", method}, {"params", std::move(params)}};
    if (!session.empty()) request["sessionId"] = session;
    write_whole(request.dump() + '\0');
    for (;;) {
      nlohmann::json answer = nlohmann::json::parse(read_text(), nullptr, false);
      if (answer.is_discarded())
        throw IoError("the browser answered with something else than JSON");
      if (answer.value("id", -1) != id) continue;  // an event
      if (answer.contains("error"))
        throw IoError(fmt::format("the browser refused {}: {}", method,
                                  answer["error"].value("message", std::string("no reason"))));
      return answer.at("result");
    }
  }
  std::string session;

 private:
  /// A folder of its own for the browser's profile, removed at the end.
  struct Profile {
    std::filesystem::path path;
    Profile() {
      std::string name = (std::filesystem::temp_directory_path() / "porthos-film-XXXXXX").string();
      if (!mkdtemp(name.data()))
        throw IoError(fmt::format("cannot make a folder {}: {}", name,
                                  std::generic_category().message(errno)));
      path = name;
    }
    ~Profile() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
    Profile(const Profile&) = delete;
    Profile& operator=(const Profile&) = delete;
  };

  [[noreturn]] static void fail(const std::string& what) {
    throw IoError(what + ": " + std::generic_category().message(errno));
  }
  std::string ended() const {
    return "the browser ended before it answered, expected a Chromium or Chrome: " + name_;
  }
  void write_whole(std::string_view text) {
    const WithoutPipeSignal quiet;
    while (!text.empty()) {
      const ssize_t n = write(to_, text.data(), text.size());
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw IoError(ended());
      text.remove_prefix(size_t(n));
    }
  }
  std::string read_text() {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(patience_s);
    for (size_t zero; (zero = buffer_.find('\0')) == std::string::npos;) {
      if (stop_ && *stop_) throw IoError("interrupted");
      if (std::chrono::steady_clock::now() > end)
        throw IoError(fmt::format("the browser did not answer within {} s", patience_s));
      pollfd ready{from_, POLLIN, 0};
      if (poll(&ready, 1, 200) <= 0) continue;
      char bytes[65536];
      const ssize_t n = read(from_, bytes, sizeof bytes);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) throw IoError(ended());
      buffer_.append(bytes, size_t(n));
    }
    const size_t zero = buffer_.find('\0');
    std::string text = buffer_.substr(0, zero);
    buffer_.erase(0, zero + 1);
    return text;
  }

  Profile profile_;
  const std::atomic<bool>* stop_;
  pid_t child_ = -1;
  int to_ = -1, from_ = -1, last_id_ = 0;
  std::string buffer_, name_;
};

BrowserPage::BrowserPage(const std::filesystem::path& browser, const std::filesystem::path& file,
                         const std::string& fragment, int width, int height,
                         const std::atomic<bool>* stop)
    : process_(std::make_unique<Process>(browser, width, height, stop)) {
  const nlohmann::json target = process_->ask("Target.createTarget", {{"url", "about:blank"}});
  const nlohmann::json attached = process_->ask(
      "Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}});
  process_->session = attached.at("sessionId").get<std::string>();
  process_->ask(
      "Emulation.setDeviceMetricsOverride",
      {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
  process_->ask("Page.navigate", {{"url", file_address(file, fragment)}});
}
BrowserPage::~BrowserPage() = default;

std::string BrowserPage::value(const std::string& expression) {
  const nlohmann::json r =
      process_->ask("Runtime.evaluate",
                    {{"expression", expression}, {"awaitPromise", true}, {"returnByValue", true}});
  if (r.contains("exceptionDetails")) {
    const nlohmann::json& why = r["exceptionDetails"];
    throw IoError(why.contains("exception")
                      ? why["exception"].value("description", why.value("text", std::string()))
                      : why.value("text", std::string("an error in the page")));
  }
  return r.at("result").value("value", nlohmann::json()).dump();
}

std::string BrowserPage::data(const std::string& method, const std::string& parameters) {
  return process_->ask(method, nlohmann::json::parse(parameters)).at("data").dump();
}

}  // namespace porthos::report
