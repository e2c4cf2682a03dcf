// clamor_structures_test.cpp: structures of the C interface whose size the caller forgot, or has
// wrong.
#include <functional>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "runtime/clamor.h"
#include "tests/library/library_room.h"
#include "tests/library/telling_context.h"

namespace clamor {
namespace {

using testing::add_listener;
using ::testing::AllOf;
using testing::Context;
using testing::context_that_tells;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::offline;
using testing::open_level;
using testing::room_with_cage;
using testing::Told;

// Calls a function with a structure of that size. Functions with a clamor_error write into it.
using Call = std::function<clamor_result(uint32_t bytes, clamor_error* error)>;

template <class T>
T of_size(uint32_t bytes) {
  T structure{};
  structure.bytes = bytes;
  return structure;
}

class ClamorStructures : public ::testing::Test {
 protected:
  ClamorStructures() {
    clamor_listener_options options = offline();
    options.reports_voices = 1;
    listener_ = add_listener(context_, level_, options);
    EXPECT_EQ(clamor_get_level_part(get(), level_, 0, &part_), CLAMOR_OK);
  }

  clamor_context* get() const { return context_.get(); }

  // By the name of the structure. Sizes are wrong, so other arguments may be, too.
  std::map<std::string, Call> with_errors() {
    return {
        {"clamor_options",
         [](uint32_t bytes, clamor_error* error) {
           const auto options = of_size<clamor_options>(bytes);
           clamor_context* made = nullptr;
           return clamor_create(&options, &made, error);
         }},
        {"clamor_reader",
         [this](uint32_t bytes, clamor_error* error) {
           const auto reader = of_size<clamor_reader>(bytes);
           return clamor_open_level_with(get(), &reader, &handle_, error);
         }},
        {"clamor_listener_options",
         [this](uint32_t bytes, clamor_error* error) {
           const auto options = of_size<clamor_listener_options>(bytes);
           return clamor_create_listener(get(), level_, &options, &handle_, error);
         }},
        {"clamor_sound_options",
         [this](uint32_t bytes, clamor_error* error) {
           const auto options = of_size<clamor_sound_options>(bytes);
           const float sample = 0.5f;
           return clamor_add_sound(get(), &sample, 1, &options, &handle_, error);
         }},
        {"clamor_stream",
         [this](uint32_t bytes, clamor_error* error) {
           const auto stream = of_size<clamor_stream>(bytes);
           return clamor_add_stream(get(), &stream, &handle_, error);
         }},
        {"clamor_part_options",
         [this](uint32_t bytes, clamor_error* error) {
           const auto options = of_size<clamor_part_options>(bytes);
           return clamor_add_part(get(), &options, &handle_, error);
         }},
    };
  }

  std::map<std::string, Call> without_errors() {
    return {
        {"clamor_level_info",
         [this](uint32_t bytes, clamor_error*) {
           auto info = of_size<clamor_level_info>(bytes);
           return clamor_get_level_info(get(), level_, &info);
         }},
        {"clamor_emitter_info",
         [this](uint32_t bytes, clamor_error*) {
           auto info = of_size<clamor_emitter_info>(bytes);
           return clamor_get_emitter_info(get(), level_, 0, &info);
         }},
        {"clamor_portal_info",
         [this](uint32_t bytes, clamor_error*) {
           auto info = of_size<clamor_portal_info>(bytes);
           return clamor_get_portal_info(get(), level_, 0, &info);
         }},
        {"clamor_part_info",
         [this](uint32_t bytes, clamor_error*) {
           auto info = of_size<clamor_part_info>(bytes);
           return clamor_get_part_info(get(), part_, &info);
         }},
        {"clamor_listener_statistics",
         [this](uint32_t bytes, clamor_error*) {
           auto statistics = of_size<clamor_listener_statistics>(bytes);
           return clamor_get_listener_statistics(get(), listener_, &statistics);
         }},
        {"clamor_voices",
         [this](uint32_t bytes, clamor_error*) {
           auto voices = of_size<clamor_voices>(bytes);
           return clamor_get_voices(get(), listener_, &voices);
         }},
        {"clamor_group_options",
         [this](uint32_t bytes, clamor_error*) {
           const auto options = of_size<clamor_group_options>(bytes);
           return clamor_add_group(get(), &options, &handle_);
         }},
        {"clamor_source_options",
         [this](uint32_t bytes, clamor_error*) {
           const auto options = of_size<clamor_source_options>(bytes);
           return clamor_add_source(get(), &options, &handle_);
         }},
        {"clamor_emitter_options",
         [this](uint32_t bytes, clamor_error*) {
           const auto options = of_size<clamor_emitter_options>(bytes);
           return clamor_change_emitter(get(), level_, 0, &options);
         }},
    };
  }

  Told told_;
  const Context context_ = context_that_tells(told_, true);
  const clamor_level level_ = open_level(context_, room_with_cage());
  clamor_listener listener_ = 0;
  clamor_part part_ = 0;
  uint64_t handle_ = 0;
};

auto names(const std::string& structure, uint32_t bytes) {
  return AllOf(HasSubstr(structure + ".bytes is " + std::to_string(bytes) + ","),
               HasSubstr("set it to sizeof(" + structure + ") before the call"));
}

TEST_F(ClamorStructures, WithoutTheirSizeAreNamedInTheError) {
  for (const auto& [structure, call] : with_errors())
    for (const uint32_t bytes : {0u, 3u, 4097u, 0xffffffffu}) {
      clamor_error error{};
      EXPECT_EQ(call(bytes, &error), CLAMOR_ERROR_ARGUMENT) << structure;
      EXPECT_EQ(error.code, CLAMOR_ERROR_ARGUMENT);
      EXPECT_THAT(error.sentence, names(structure, bytes));
    }
  EXPECT_THAT(told_.sentences, IsEmpty());
}

TEST_F(ClamorStructures, WithoutTheirSizeAreNamedInTheLogWhereThereIsNoError) {
  for (const auto& [structure, call] : without_errors())
    for (const uint32_t bytes : {0u, 3u, 4097u, 0xffffffffu}) {
      EXPECT_EQ(call(bytes, nullptr), CLAMOR_ERROR_ARGUMENT) << structure;
      EXPECT_THAT(told_.sentences, ElementsAre(names(structure, bytes)));
      told_.sentences.clear();
    }
}

TEST_F(ClamorStructures, WithMembersOfANewerLibrarySayThatItIsNeeded) {
  struct Newer {
    clamor_options known{};
    uint64_t added = 1;
  } newer;
  newer.known.bytes = sizeof newer;
  clamor_error error{};
  clamor_context* made = nullptr;
  EXPECT_EQ(clamor_create(&newer.known, &made, &error), CLAMOR_ERROR_ARGUMENT);
  EXPECT_THAT(error.sentence,
              AllOf(HasSubstr("clamor_options.bytes is " + std::to_string(sizeof newer)),
                    HasSubstr("knows " + std::to_string(sizeof(clamor_options)) + " bytes"),
                    HasSubstr("install the library of the program's header")));
  newer.added = 0;
  EXPECT_EQ(clamor_create(&newer.known, &made, &error), CLAMOR_OK) << error.sentence;
  clamor_destroy(made);
}

TEST_F(ClamorStructures, WithTheirSizeLeaveOtherFaultsToOtherSentences) {
  clamor_options options{};
  options.bytes = sizeof options;
  options.update_period_s = 7;
  clamor_context* made = nullptr;
  clamor_error error{};
  EXPECT_EQ(clamor_create(&options, &made, &error), CLAMOR_ERROR_ARGUMENT);
  EXPECT_THAT(error.sentence, HasSubstr("update_period_s"));
  clamor_emitter_options gain{};
  gain.bytes = sizeof gain;
  gain.has_gain = 1, gain.gain = 2;
  EXPECT_EQ(clamor_change_emitter(get(), level_, 0, &gain), CLAMOR_ERROR_ARGUMENT);
  EXPECT_THAT(told_.sentences, IsEmpty());
}

}  // namespace
}  // namespace clamor
