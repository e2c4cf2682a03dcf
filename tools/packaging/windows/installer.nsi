; installer.nsi: the installer of clamor.exe, its libraries and licences, by `tools/package --windows`:
;   makensis -DVERSION=0.1.0 -DFOLDER=what-to-install -DOUT=setup.exe installer.nsi
; /S installs without questions, and /D=C:\FOLDER, as the last option, chooses the folder.
Target amd64-unicode ; one of 32 bits needs a Wine of 32 bits to be tried
SetCompressor /SOLID lzma
Name "Clamor ${VERSION}"
OutFile "${OUT}"
RequestExecutionLevel user
InstallDir "$LOCALAPPDATA\Programs\Clamor"
InstallDirRegKey HKCU "Software\Clamor" "Folder"
!define ENTRY "Software\Microsoft\Windows\CurrentVersion\Uninstall\Clamor"

!include MUI2.nsh
!insertmacro MUI_PAGE_LICENSE "${FOLDER}/LICENSE.txt"
!insertmacro MUI_PAGE_DIRECTORY
!insertmacro MUI_PAGE_INSTFILES
!insertmacro MUI_UNPAGE_CONFIRM
!insertmacro MUI_UNPAGE_INSTFILES
!insertmacro MUI_LANGUAGE "English"

Section
  SetOutPath "$INSTDIR"
  File /r "${FOLDER}/*"
  WriteUninstaller "$INSTDIR\uninstall.exe"
  ; PATH is left as it is: programs of NSIS cut one of more than 1024 characters.
  CreateShortcut "$SMPROGRAMS\Clamor.lnk" "$SYSDIR\cmd.exe" '/k "set PATH=$INSTDIR\bin;%PATH%"' \
    "$INSTDIR\bin\clamor.exe"
  WriteRegStr HKCU "Software\Clamor" "Folder" "$INSTDIR"
  WriteRegStr HKCU "${ENTRY}" "DisplayName" "Clamor"
  WriteRegStr HKCU "${ENTRY}" "DisplayVersion" "${VERSION}"
  WriteRegStr HKCU "${ENTRY}" "UninstallString" '"$INSTDIR\uninstall.exe"'
  WriteRegStr HKCU "${ENTRY}" "QuietUninstallString" '"$INSTDIR\uninstall.exe" /S'
SectionEnd

; What the user has put into the folder stays.
Section Uninstall
  RMDir /r "$INSTDIR\bin"
  RMDir /r "$INSTDIR\include"
  RMDir /r "$INSTDIR\lib"
  Delete "$INSTDIR\LICENSE.txt"
  Delete "$INSTDIR\THIRD_PARTY.txt"
  Delete "$INSTDIR\README.txt"
  Delete "$INSTDIR\uninstall.exe"
  RMDir "$INSTDIR"
  Delete "$SMPROGRAMS\Clamor.lnk"
  DeleteRegKey HKCU "${ENTRY}"
  DeleteRegKey HKCU "Software\Clamor"
SectionEnd
