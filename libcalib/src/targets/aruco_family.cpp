// ArUco's dictionaries (Garrido-Jurado et al. 2014): which cells are light, from OpenCV.
#include <opencv2/aruco/dictionary.hpp>

#include "target_family_impl.h"

namespace lumihull::calib {
namespace {

struct Dictionary {
  std::string_view name;
  cv::aruco::PREDEFINED_DICTIONARY_NAME number;
};

constexpr Dictionary kDictionaries[] = {
    {"4x4_50", cv::aruco::DICT_4X4_50},          {"4x4_100", cv::aruco::DICT_4X4_100},
    {"4x4_250", cv::aruco::DICT_4X4_250},        {"4x4_1000", cv::aruco::DICT_4X4_1000},
    {"5x5_50", cv::aruco::DICT_5X5_50},          {"5x5_100", cv::aruco::DICT_5X5_100},
    {"5x5_250", cv::aruco::DICT_5X5_250},        {"5x5_1000", cv::aruco::DICT_5X5_1000},
    {"6x6_50", cv::aruco::DICT_6X6_50},          {"6x6_100", cv::aruco::DICT_6X6_100},
    {"6x6_250", cv::aruco::DICT_6X6_250},        {"6x6_1000", cv::aruco::DICT_6X6_1000},
    {"7x7_50", cv::aruco::DICT_7X7_50},          {"7x7_100", cv::aruco::DICT_7X7_100},
    {"7x7_250", cv::aruco::DICT_7X7_250},        {"7x7_1000", cv::aruco::DICT_7X7_1000},
    {"original", cv::aruco::DICT_ARUCO_ORIGINAL}};

}  // namespace

std::optional<SquareWords> aruco_words(std::string_view name) {
  for (const Dictionary& known : kDictionaries) {
    if (known.name != name) continue;
    const cv::Ptr<cv::aruco::Dictionary> dictionary = cv::aruco::getPredefinedDictionary(known.number);
    SquareWords square{dictionary->markerSize, {}};
    for (int id = 0; id < dictionary->bytesList.rows; ++id) {
      const cv::Mat bits = cv::aruco::Dictionary::getBitsFromByteList(dictionary->bytesList.row(id), square.side);
      CellBits cells = 0;
      for (int i = 0; i < square.side * square.side; ++i)
        if (bits.at<unsigned char>(i / square.side, i % square.side)) cells |= CellBits(1) << i;
      square.words.push_back(cells);
    }
    return square;
  }
  return std::nullopt;
}

std::vector<std::string> aruco_names() {
  std::vector<std::string> names;
  for (const Dictionary& known : kDictionaries) names.emplace_back(known.name);
  return names;
}

}  // namespace lumihull::calib
