#include "runtime/output/device_selection.h"

#include <gtest/gtest.h>

namespace clamor {
namespace {

std::vector<OutputDevice> desk() {
  return {{"pulse", "Built-in Audio", 2, {44100, 48000}, false},
          {"pulse", "USB Headset", 2, {48000}, true},
          {"jack", "system", 8, {96000}, true},
          {"alsa", "default", 2, {44100, 48000}, true},
          {"alsa", "hw:USB,0", 2, {44100}, false},
          {"alsa", "hw:USB,1", 2, {44100}, false}};
}

std::string chosen(const std::string& wanted) {
  const auto device = choose_device(desk(), wanted);
  return device.ok() ? device->full_name() : "error: " + device.error().message;
}

TEST(DeviceChoice, WithoutAWordIsTheDefaultOfTheFirstApi) {
  EXPECT_EQ(chosen(""), "pulse: USB Headset");
}

TEST(DeviceChoice, TakesAnApiForItsDefault) {
  EXPECT_EQ(chosen("pulse"), "pulse: USB Headset");
  EXPECT_EQ(chosen("jack"), "jack: system");
  EXPECT_EQ(chosen("ALSA"), "alsa: default");
}

TEST(DeviceChoice, TakesWholeNamesBeginningsAndPartsWhateverTheirCase) {
  EXPECT_EQ(chosen("jack: system"), "jack: system");
  EXPECT_EQ(chosen("default"), "alsa: default");
  EXPECT_EQ(chosen("built-in"), "pulse: Built-in Audio");
  EXPECT_EQ(chosen("headset"), "pulse: USB Headset");
  EXPECT_EQ(chosen("hw:usb,1"), "alsa: hw:USB,1");
}

// "usb" is a prefix of the headset's name and a substring of others.
TEST(DeviceChoice, PrefersABeginningToAPart) { EXPECT_EQ(chosen("usb"), "pulse: USB Headset"); }

TEST(DeviceChoice, SaysWhatANameMayMean) {
  EXPECT_EQ(chosen("hw:"),
            "error: 'hw:' may mean 2 sound devices: 'alsa: hw:USB,0', 'alsa: hw:USB,1'; write more "
            "of the name");
}

TEST(DeviceChoice, SaysWhatThereIsWhenThereIsNoSuchDevice) {
  const std::string text = chosen("sofa");
  EXPECT_NE(text.find("no sound device is called 'sofa'"), std::string::npos) << text;
  for (const OutputDevice& device : desk())
    EXPECT_NE(text.find(device.full_name()), std::string::npos) << text;
  EXPECT_NE(choose_device({}, "").error().message.find("--device none"), std::string::npos);
}

// A card with "jack" in its name does not match the API's name.
TEST(DeviceChoice, SaysThatNoServerIsRunningWhereNothingAnswersForAnApi) {
  const std::vector<OutputDevice> devices = {{"alsa", "hw:Headphone Jack", 2, {48000}, true}};
  const auto missing = choose_device(devices, "JACK");
  ASSERT_FALSE(missing.ok());
  EXPECT_EQ(missing.error().message,
            "no JACK server is running; start one, or name another device: there is 'alsa: "
            "hw:Headphone Jack'");
  const auto nothing = choose_device({}, "jack");
  ASSERT_FALSE(nothing.ok());
  EXPECT_EQ(nothing.error().message,
            "no JACK server is running; start one, or use --device none to play in silence");
}

TEST(DeviceRates, AreOursOrTheNextAboveOrTheHighestBelow) {
  using Rates = std::vector<int>;
  EXPECT_EQ(rates_to_try({"", "", 2, {96000, 44100, 48000}}, 0), (Rates{48000, 96000, 44100}));
  EXPECT_EQ(rates_to_try({"", "", 2, {44100, 192000, 22050, 88200}}, 0),
            (Rates{88200, 192000, 44100, 22050}));
  EXPECT_EQ(rates_to_try({"", "", 2, {44100}}, 96000), Rates{96000});
  EXPECT_EQ(rates_to_try({"", "", 2, {}}, 0), Rates{48000});
}

}  // namespace
}  // namespace clamor
