// Fuzz target: sets of targets from files and words, and cells that a detector may have read. What is read can be
// written and read again, and is the same.

#include <lumihull/base/error.h>
#include <target_set_impl.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>

namespace {

using namespace lumihull;
using namespace lumihull::calib;

template <class Read>
std::optional<TargetSet> read_or_refuse(Read read) {
  try {
    return read();
  } catch (const Error& e) {
    if (e.code() == ErrorCode::internal || e.code() == ErrorCode::out_of_memory) std::abort();
    return std::nullopt;
  }
}

void write_and_read(const TargetSet& set) {
  set.validate();
  const std::string text = calib::internal::print_target_set(set, "again");
  if (calib::internal::print_target_set(calib::internal::parse_target_set(text, "again"), "again") != text) std::abort();
  for (const TargetDesign& design : set.designs)
    for (int i = 0; i < design.features(); ++i)
      if (!design.feature(i).allFinite()) std::abort();
}

void decode(const std::uint8_t* data, std::size_t size) {
  for (const char* name : {"paper4x4", "matrix5x5", "matrix6x6"}) {
    static_assert(int(Cell::unknown) == 2);
    const TargetFamily family = TargetFamily::by_name(name);
    std::vector<Cell> cells(std::size_t(family.grid() * family.grid()), Cell::dark);
    for (std::size_t i = 0; i < cells.size() && i < size; ++i) cells[i] = Cell(data[i] % 3);
    const auto read = family.decode(cells);
    if (read && (!family.has(read->id) || read->quarter_turns < 0 || read->quarter_turns > 3)) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  if (const auto set = read_or_refuse([&] { return calib::internal::parse_target_set(text, "fuzz"); }))
    write_and_read(*set);
  if (const auto set = read_or_refuse([&] { return TargetSet::from_word(text); })) write_and_read(*set);
  decode(data, size);
  return 0;
}
