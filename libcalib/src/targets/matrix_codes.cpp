#include "matrix_codes.h"

#include <numeric>

namespace lumihull::calib {

std::vector<std::vector<int>> extended_cyclic_code(int q, int n, const std::vector<int>& generator) {
  const int checks = int(generator.size()) - 1;
  int count = 1;
  for (int i = checks; i < n; ++i) count *= q;

  std::vector<std::vector<int>> words;
  words.reserve(std::size_t(count));
  for (int m = 0; m < count; ++m) {
    std::vector<int> word(std::size_t(n) + 1, 0);
    for (int i = checks, rest = m; i < n; ++i, rest /= q) word[std::size_t(i)] = rest % q;
    // Division by the monic generator leaves the remainder in the lowest coefficients; less it, the word is a multiple.
    std::vector<int> rest = word;
    for (int top = n - 1; top >= checks; --top) {
      const int factor = rest[std::size_t(top)];
      for (int i = 0; i <= checks; ++i) {
        int& c = rest[std::size_t(top - checks + i)];
        c = ((c - factor * generator[std::size_t(i)]) % q + q) % q;
      }
    }
    for (int i = 0; i < checks; ++i) word[std::size_t(i)] = (q - rest[std::size_t(i)]) % q;
    word[std::size_t(n)] = (q - std::accumulate(word.begin(), word.end(), 0) % q) % q;
    words.push_back(std::move(word));
  }
  return words;
}

std::vector<std::uint32_t> golay_words() {
  std::vector<std::uint32_t> words;
  for (const std::vector<int>& symbols : extended_cyclic_code(2, 23, {1, 1, 0, 0, 0, 1, 1, 1, 0, 1, 0, 1})) {
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < symbols.size(); ++i) word |= std::uint32_t(symbols[i]) << i;
    words.push_back(word);
  }
  return words;
}

std::vector<std::uint32_t> nordstrom_robinson_words() {
  std::vector<std::uint32_t> words;
  for (const std::vector<int>& symbols : extended_cyclic_code(4, 7, {3, 1, 2, 1})) {
    std::uint32_t word = 0;
    for (std::size_t j = 0; j < symbols.size(); ++j) {
      constexpr std::uint32_t kGray[] = {0b00, 0b10, 0b11, 0b01};  // its lower bit is bit 2j
      word |= kGray[symbols[j]] << (2 * j);
    }
    words.push_back(word);
  }
  return words;
}

}  // namespace lumihull::calib
