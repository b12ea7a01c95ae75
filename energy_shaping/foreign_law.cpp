#include "energy_shaping/foreign_law.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <mutex>
#include <span>
#include <utility>

#include "phs/error.h"

namespace porthos::energy_shaping {
namespace {

using Message = std::array<char, PORTHOS_LAW_MESSAGE>;

/// Bytes in the memory of a run: their number, then six bytes in each number. Whole numbers below
/// 2⁴⁸ keep their bits wherever a memory is copied or written.
constexpr size_t bytes_each = 6;
size_t numbers_for(size_t bytes) { return 1 + (bytes + bytes_each - 1) / bytes_each; }

void pack(const std::string& bytes, std::span<double> memory) {
  std::fill(memory.begin(), memory.end(), 0.0);
  memory[0] = double(bytes.size());
  for (size_t i = 0; i < bytes.size(); i += bytes_each) {
    std::uint64_t word = 0;
    for (size_t k = i; k < std::min(i + bytes_each, bytes.size()); ++k)
      word |= std::uint64_t(static_cast<unsigned char>(bytes[k])) << (8 * (k - i));
    memory[1 + i / bytes_each] = double(word);
  }
}
void unpack(std::span<const double> memory, std::string& bytes) {
  bytes.resize(whole<size_t>(memory[0], 0, double((memory.size() - 1) * bytes_each)));
  for (size_t i = 0; i < bytes.size(); i += bytes_each) {
    const auto word = whole<std::uint64_t>(memory[1 + i / bytes_each], 0, 0x1p48);
    for (size_t k = i; k < std::min(i + bytes_each, bytes.size()); ++k)
      bytes[k] = char(word >> (8 * (k - i)) & 0xff);
  }
}

class ForeignLaw final : public phs::SampledLaw {
  /// One object of the law, and the bytes of what it remembers now.
  struct Object {
    Object(const porthos_law& f, void* its) : functions(f), law(its) {}
    Object(const Object&) = delete;
    ~Object() { functions.destroy(law); }
    const porthos_law& functions;
    void* law;
    std::string state = {}, wanted = {};
    std::vector<double> q = {}, inputs = {}, tau = {};
    Message message{};
  };
  using ObjectPtr = std::unique_ptr<Object>;

 public:
  ForeignLaw(const porthos_law& functions, std::string name, std::vector<LawJoint> joints,
             std::string settings, LawInputs inputs, size_t room)
      : functions_(functions),
        name_(std::move(name)),
        joints_(std::move(joints)),
        settings_(std::move(settings)),
        inputs_(std::move(inputs)),
        room_(room > 0 ? room : most_at_start) {
    ObjectPtr first = make();
    save(*first, name_);
    if (room == 0) room_ = first->state.empty() ? 0 : 2 * first->state.size() + 4096;
    fresh_.resize(numbers_for(room_));
    pack(first->state, fresh_);
    idle_.push_back(std::move(first));
  }

  std::vector<double> fresh() const override { return fresh_; }

  void operator()(double t, std::span<const double> x, std::span<const double> v,
                  std::span<double> memory, std::span<double> u) const override {
    ObjectPtr o = borrow();
    const auto at = [&] { return fmt::format("{} at t = {} s", name_, t); };
    if (functions_.restore) {
      unpack(memory, o->wanted);
      if (o->wanted != o->state) restore(*o, at());
    }
    for (size_t k = 0; k < joints_.size(); ++k) o->q[k] = x[joints_[k].q];
    if (inputs_.size > 0) inputs_.at(t, x, o->inputs);
    std::fill(o->tau.begin(), o->tau.end(), NAN);
    if (functions_.torques(o->law, t, o->q.data(), v.data(), o->inputs.data(), o->tau.data(),
                           o->message.data()) != 0)
      fail(*o, at());
    for (size_t k = 0; k < joints_.size(); ++k)
      if (!std::isfinite(o->tau[k]))
        throw LawFailure(fmt::format("{}: the torque of '{}' is {}, expected a finite number", at(),
                                     joints_[k].name, o->tau[k]));
    std::copy(o->tau.begin(), o->tau.end(), u.begin());
    if (functions_.save) {
      save(*o, at());
      pack(o->state, memory);
    }
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(o));
  }

 private:
  static constexpr size_t most_at_start = size_t(1) << 24;

  [[noreturn]] static void fail(Object& o, const std::string& where) {
    o.message.back() = '\0';
    throw LawFailure(where + ": " + (o.message[0] ? o.message.data() : "the law failed"));
  }
  ObjectPtr make() const {
    std::vector<const char*> names;
    for (const auto& j : joints_) names.push_back(j.name.c_str());
    Message message{};
    void* const law = functions_.create(int(names.size()), names.data(), int(inputs_.size),
                                        settings_.c_str(), message.data());
    message.back() = '\0';
    if (!law)
      throw LawFailure(name_ + ": " + (message[0] ? message.data() : "the law could not be made"));
    auto o = std::make_unique<Object>(functions_, law);
    o->q.resize(joints_.size());
    o->inputs.resize(inputs_.size);
    o->tau.resize(joints_.size());
    return o;
  }
  ObjectPtr borrow() const {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        ObjectPtr o = std::move(idle_.back());
        idle_.pop_back();
        return o;
      }
    }
    ObjectPtr o = make();
    save(*o, name_);
    return o;
  }
  void save(Object& o, const std::string& where) const {
    if (!functions_.save) return;
    o.state.resize(room_);
    const int size = functions_.save(o.law, o.state.data(), int(room_), o.message.data());
    if (size < 0) fail(o, where);
    if (size_t(size) > room_)
      throw LawFailure(
          fmt::format("{}: the law remembers {} bytes and there is room for {}, expected memory = "
                      "{} or more, or a law that does not remember its past",
                      where, size, room_, 2 * size));
    o.state.resize(size_t(size));
  }

  void restore(Object& o, const std::string& where) const {
    if (functions_.restore(o.law, o.wanted.data(), int(o.wanted.size()), o.message.data()) != 0)
      fail(o, where);
    o.state = o.wanted;
  }

  const porthos_law& functions_;
  const std::string name_;
  const std::vector<LawJoint> joints_;
  const std::string settings_;
  const LawInputs inputs_;
  size_t room_;
  std::vector<double> fresh_;
  mutable std::mutex mutex_;
  mutable std::vector<ObjectPtr> idle_;
};

}  // namespace

const porthos_law& open_law_library(const std::string& path, bool with_its_symbols) {
  void* const library = dlopen(path.c_str(), RTLD_NOW | (with_its_symbols ? RTLD_GLOBAL : 0));
  if (!library)
    throw InvalidArgument(fmt::format("the law library cannot be loaded: {}", dlerror()));
  void* const symbol = dlsym(library, "porthos_law_functions");
  if (!symbol)
    throw InvalidArgument(path + " has no function porthos_law_functions, see porthos_law.h");
  const auto* const law = reinterpret_cast<const porthos_law* (*)()>(symbol)();
  if (!law) throw InvalidArgument(path + " could not be started");
  if (law->version != PORTHOS_LAW_VERSION)
    throw InvalidArgument(fmt::format("{} is of version {} of porthos_law.h, expected {}", path,
                                      law->version, PORTHOS_LAW_VERSION));
  const bool whole = law->create && law->torques && law->destroy;
  if (!whole || !law->save != !law->restore)
    throw InvalidArgument(
        path + " lacks a function, expected create, torques and destroy, and save with restore");
  return *law;
}

phs::SampledLawPtr foreign_law(const porthos_law& functions, const std::string& name,
                               std::vector<LawJoint> joints, const std::string& settings,
                               LawInputs inputs, size_t room) {
  return std::make_shared<ForeignLaw>(functions, name, std::move(joints), settings,
                                      std::move(inputs), room);
}

}  // namespace porthos::energy_shaping
