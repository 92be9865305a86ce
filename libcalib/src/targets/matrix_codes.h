#pragma once

// The words of the circle families' codes, built from their algebra; no table of words is stored.

#include <cstdint>
#include <vector>

namespace lumihull::calib {

/// Words of an extended cyclic code over Z_q, systematic: word m holds the k base-q digits of m as its coefficients of
/// x^(n-k) … x^(n-1), the remainder that makes it a multiple of the generator below them, and at last the symbol that
/// makes the sum of all 0. Each word: n + 1 symbols of 0 … q - 1.
///
/// generator: coefficients of g(x) from x^0 up, monic, a divisor of x^n - 1 over Z_q; k = n - degree.
std::vector<std::vector<int>> extended_cyclic_code(int q, int n, const std::vector<int>& generator);

/// The extended binary Golay code (Golay 1949) in its cyclic form, g = x^11 + x^9 + x^7 + x^6 + x^5 + x + 1: 4096 words
/// of 24 bits, bit i the coefficient of x^i, bit 23 the parity; least distance 8.
std::vector<std::uint32_t> golay_words();

/// The Nordstrom-Robinson code (Nordstrom & Robinson 1967) as the Gray image of the octacode over Z_4, g = x^3 + 2 x^2
/// + x - 1 (Hammons, Kumar, Calderbank, Sloane & Sole 1994): 256 words of 16 bits, symbol j as the bits 2j and 2j + 1
/// by 0 -> 00, 1 -> 01, 2 -> 11, 3 -> 10; least distance 6, no linear code of that size has it.
std::vector<std::uint32_t> nordstrom_robinson_words();

}  // namespace lumihull::calib
