#include "bench/method.h"

#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

struct Name {
  Method method;
  const char* name;
};
constexpr Name kNames[] = {
    {Method::inverse4x4_double, "inverse4x4-double"},
    {Method::inverse3x3_double, "inverse3x3-double"},
    {Method::inverse3x3_float, "inverse3x3-float"},
    {Method::paper, "paper"},
    {Method::gascon, "gascon"},
    {Method::tetwarp, "tetwarp"},
};

}  // namespace

std::string name_of(Method method) { return kNames[static_cast<int>(method)].name; }

std::string name_of(FieldSource source) { return source == FieldSource::kernel ? "kernel" : "memory"; }

Method parse_method(const std::string& name) {
  std::string known;
  for (const Name& entry : kNames) {
    if (name == entry.name) return entry.method;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw InputError("no method \"" + name + "\"; choose from " + known);
}

}  // namespace tetwarp::bench
