#include "bone_names.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <set>
#include <span>
#include <string_view>

#include "bone_words.h"

namespace layfigure::doll {
namespace {

using Words = std::vector<std::string>;

template <typename List>
bool has(const List& list, std::string_view word) {
  return std::find(std::begin(list), std::end(list), word) != std::end(list);
}

bool is_number(std::string_view word) { return std::isdigit(static_cast<unsigned char>(word.front())) != 0; }

BonePart find(std::span<const Row> rows, std::string_view word) {
  const auto row = std::find_if(rows.begin(), rows.end(), [&](const Row& r) { return r.word == word; });
  return row == rows.end() ? BonePart::kUnknown : row->part;
}

/// Lower-case words: "LHipJoint" -> l hip joint, "finger2-1.L" -> finger 2 1 l.
Words split(std::string_view name) {
  const auto at = [&](std::size_t i) { return static_cast<unsigned char>(i < name.size() ? name[i] : '\0'); };
  Words words;
  bool begins = true;
  for (std::size_t i = 0; i < name.size(); ++i) {
    if (std::isalnum(at(i)) == 0) {
      begins = true;
      continue;
    }
    const bool was_upper = i > 0 && std::isupper(at(i - 1)) != 0;
    const bool was_digit = i > 0 && std::isdigit(at(i - 1)) != 0;
    const bool upper = std::isupper(at(i)) != 0;
    begins = begins || (std::isdigit(at(i)) != 0) != was_digit || (upper && !was_upper) ||
             (upper && was_upper && std::islower(at(i + 1)) != 0);
    if (begins) words.emplace_back();
    words.back() += static_cast<char>(std::tolower(at(i)));
    begins = false;
  }
  return words;
}

/// Words of a name by what they are for.
struct Reading {
  BodySide side{BodySide::kNone};
  BoneUse use{BoneUse::kLimb};
  Words core;
  Words numbers;
  std::string stem;

  [[nodiscard]] std::string joined() const {
    std::string text;
    for (const std::string& word : core) text += word;
    return text;
  }
};

BodySide side_of(std::string_view word) {
  if (word == "l" || word == "left") return BodySide::kLeft;
  if (word == "r" || word == "right") return BodySide::kRight;
  return BodySide::kNone;
}

/// "leftupleg" -> left upleg.
void part_side(Words& words) {
  if (std::any_of(words.begin(), words.end(), [](const std::string& w) { return side_of(w) != BodySide::kNone; })) {
    return;
  }
  for (const std::string side : {"left", "right"}) {
    for (std::size_t i = 0; i < words.size(); ++i) {
      const std::string word = words[i];
      if (word.size() <= side.size()) continue;
      const bool first = word.starts_with(side);
      if (!first && !word.ends_with(side)) continue;
      words[i] = first ? word.substr(side.size()) : word.substr(0, word.size() - side.size());
      words.push_back(side);
      return;
    }
  }
}

void drop_prefixes(Words& words) {
  while (words.size() > 1 && (has(kPrefixes, words.front()) || is_number(words.front()))) words.erase(words.begin());
}

BoneUse use_of(const Words& words) {
  const auto any = [&](const auto& list) {
    return std::any_of(words.begin(), words.end(), [&](const std::string& word) { return has(list, word); });
  };
  if (any(kEndWords)) return BoneUse::kEnd;
  if (any(kControlWords)) return BoneUse::kControl;
  return any(kTwistWords) ? BoneUse::kTwist : BoneUse::kLimb;
}

Reading read(const std::string& name) {
  Words words = split(name.substr(name.find_last_of(":|") + 1));  // namespaces
  part_side(words);
  Reading reading;
  reading.use = use_of(words);
  for (const std::string& word : words) {
    if (side_of(word) == BodySide::kNone) reading.stem += (reading.stem.empty() ? "" : " ") + word;
  }
  drop_prefixes(words);
  for (const std::string& word : words) {
    if (side_of(word) != BodySide::kNone) {
      reading.side = side_of(word);
    } else if (is_number(word)) {
      reading.numbers.push_back(word);
    } else if (word != "c" && !has(kEndWords, word) && !has(kTwistWords, word) && !has(kControlWords, word)) {
      reading.core.push_back(word);
    }
  }
  const auto known = [&] { return find(kParts, reading.joined()) != BonePart::kUnknown; };
  while (reading.core.size() > 1 && !known() && has(kFillers, reading.core.back())) reading.core.pop_back();
  return reading;
}

/// What the words of one rig mean together.
struct Convention {
  bool shoulder_is_upper_arm{false};
  bool hip_is_thigh{false};
  bool foot_is_toes{false};
  bool thumb_has_metacarpal{false};
};

Convention convention_of(const std::vector<Reading>& readings) {
  std::set<std::string> cores;
  for (const Reading& reading : readings) {
    if (reading.use == BoneUse::kLimb && reading.side != BodySide::kNone) cores.insert(reading.joined());
  }
  const auto any = [&](std::initializer_list<const char*> words) {
    return std::any_of(words.begin(), words.end(), [&](const char* word) { return cores.contains(word); });
  };
  Convention convention;
  convention.shoulder_is_upper_arm = any({"elbow"}) && !any({"arm", "upperarm", "uparm"});
  convention.hip_is_thigh = !any({"thigh", "upleg", "upperleg", "thighbend"});
  convention.foot_is_toes = any({"ankle"}) && !any({"toe", "toes", "toebase", "ball"});
  convention.thumb_has_metacarpal = any({"thumbmetacarpal"});
  return convention;
}

/// The number of a finger's bone, 1 where none is said.
int numbered_segment(const Reading& reading, std::size_t index) {
  if (reading.numbers.size() <= index || reading.numbers[index].size() > 3) return 1;
  return std::max(1, std::stoi(reading.numbers[index]));
}

/// Which of a finger's bones the word means, 0: its metacarpal, -1: none.
int segment_of(std::string_view word, bool thumb, const Convention& convention) {
  if (word == "metacarpal") return thumb ? 1 : 0;
  if (word == "proximal") return thumb && convention.thumb_has_metacarpal ? 2 : 1;
  if (word == "intermediate") return 2;
  return word == "distal" ? 3 : -1;
}

void set_finger(BoneName& name, BonePart finger, int segment) {
  constexpr int kSegments = 3;
  name.part = segment == 0 ? BonePart::kMetacarpal : finger;
  name.segment = std::min(segment, kSegments);
  if (segment > kSegments) name.use = BoneUse::kEnd;  // Mixamo's fourth
}

/// Fingers counted from the thumb: MakeHuman's finger2-1 is the first bone of the same as Biped's Finger1, Finger11,
/// Finger12.
void set_counted_finger(const Reading& reading, BoneName& name) {
  const std::string& digits = reading.numbers[0];
  const bool two_numbers = reading.numbers.size() > 1;
  const int finger = digits.front() - (two_numbers ? '1' : '0');
  const int biped_segment = digits.size() < 2 ? 1 : digits[1] - '0' + 1;
  if (finger < 0 || finger >= static_cast<int>(std::size(kCountedFingers))) return;
  set_finger(name, kCountedFingers[finger], two_numbers ? numbered_segment(reading, 1) : biped_segment);
}

/// Fills in the finger that `reading` is of, if it is of one: one word names it, another may say which of its bones.
void read_finger(const Reading& reading, const Convention& convention, BoneName& name) {
  const std::string core = reading.joined();
  if ((core == "finger" || core == "handfinger") && !reading.numbers.empty()) return set_counted_finger(reading, name);
  Words words;
  for (const std::string& word : reading.core) {
    if (!has(kFingerFillers, word)) words.push_back(word);
  }
  if (words.empty() || words.size() > 2) return;
  if (find(kFingers, words.front()) == BonePart::kUnknown) std::swap(words.front(), words.back());
  const BonePart finger = find(kFingers, words.front());
  if (finger == BonePart::kUnknown) return;
  const bool in_hand = has(reading.core, "in");  // "LeftInHandIndex"
  const int segment = words.size() > 1 ? segment_of(words.back(), finger == BonePart::kThumb, convention)
                                       : (in_hand ? 0 : numbered_segment(reading, 0));
  if (segment >= 0) set_finger(name, finger, segment);
}

/// Rigify's spine goes on through neck and head: spine.004 and .005, .006.
BonePart part_of_spine(const Reading& reading) {
  const std::string digits = reading.numbers.empty() ? "" : reading.numbers.front();
  if (digits == "004" || digits == "005") return BonePart::kNeck;
  return digits == "006" ? BonePart::kHead : BonePart::kSpine;
}

BonePart part_of(const Reading& reading, const Convention& convention) {
  const std::string core = reading.joined();
  const bool sided = reading.side != BodySide::kNone;
  if (core == "spine") return part_of_spine(reading);
  if (core == "shoulder" && sided && convention.shoulder_is_upper_arm) return BonePart::kUpperArm;
  if (core == "hip" && sided && convention.hip_is_thigh) return BonePart::kThigh;
  if (core == "foot" && convention.foot_is_toes) return BonePart::kToes;
  if (core == "jaw" && sided) return BonePart::kFace;  // Rigify's jaw.L runs along its edge
  const BonePart part = find(kParts, core);
  if (part >= BonePart::kClavicle && !sided) return BonePart::kUnknown;  // of a lamp, of a robot
  if (part != BonePart::kUnknown) return part;
  const auto of_face = [](const std::string& word) { return has(kFaceWords, word); };
  return std::any_of(reading.core.begin(), reading.core.end(), of_face) ? BonePart::kFace : BonePart::kUnknown;
}

}  // namespace

std::vector<BoneName> read_bone_names(const std::vector<std::string>& names) {
  std::vector<Reading> readings;
  for (const std::string& name : names) readings.push_back(read(name));
  const Convention convention = convention_of(readings);
  std::vector<BoneName> result;
  for (const Reading& reading : readings) {
    BoneName name;
    name.side = reading.side;
    name.use = reading.use;
    name.stem = reading.stem;
    if (reading.side != BodySide::kNone) read_finger(reading, convention, name);
    if (name.part == BonePart::kUnknown) name.part = part_of(reading, convention);
    result.push_back(std::move(name));
  }
  return result;
}

bool is_finger(BonePart part) { return part >= BonePart::kThumb && part <= BonePart::kLittle; }

const char* part_text(BonePart part) {
  constexpr std::array kTexts{"unknown bone",  "hips",       "spine", "chest",        "neck",          "head",
                              "jaw",           "eye",        "face",  "clavicle",     "upper arm",     "forearm",
                              "hand",          "metacarpal", "thumb", "index finger", "middle finger", "ring finger",
                              "little finger", "thigh",      "shin",  "foot",         "toes"};
  return kTexts[static_cast<std::size_t>(part)];
}

}  // namespace layfigure::doll
